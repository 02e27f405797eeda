//! Loops over the rows of small matrices, written out.

/// `for i in N { body }` is `body` for every `i` below the const parameter `N`: one copy each for the first nine, with `i` known,
/// so that loops over the rest of a row have a known length when the compiler first sees them.
macro_rules! unrolled {
    (for $i:ident in $n:ident $body:block) => {
        unrolled!(@ $i $n $body 0 1 2 3 4 5 6 7 8);
        for $i in 9..$n $body
    };
    (@ $i:ident $n:ident $body:block $($value:literal)*) => {
        $(if $n > $value {
            let $i = $value;
            $body
        })*
    };
}
