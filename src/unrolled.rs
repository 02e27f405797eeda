//! Loops over the rows of small matrices: written out where the library is compiled for speed, one copy where that is better.

/// `for i in N { body }` is `body` for every `i` below the const parameter `N`: one copy each for the first nine, with `i` known,
/// so that loops over the rest of a row have a known length when the compiler first sees them.
macro_rules! written_out {
    (for $i:ident in $n:ident $body:block) => {
        written_out!(@ $i $n $body 0 1 2 3 4 5 6 7 8);
        for $i in 9..$n $body
    };
    (@ $i:ident $n:ident $body:block $($value:literal)*) => {
        $(if $n > $value {
            let $i = $value;
            $body
        })*
    };
}

/// [`written_out`]; compiled for size, it is the loop.
macro_rules! unrolled {
    (for $i:ident in $n:ident $body:block) => {
        #[cfg(not(small))]
        written_out!(for $i in $n $body);
        #[cfg(small)]
        for $i in 0..$n $body
    };
}

/// `for i in first..end { body }` in one copy, where the compiler would write out a short loop: the step of one is hidden from it.
/// Compiled for size, it is the loop.
macro_rules! rolled {
    (for $i:ident in $first:tt..$end:ident $body:block) => {
        #[cfg(not(small))]
        {
            let (mut next, one) = ($first, core::hint::black_box(1));
            while next < $end {
                let $i = next;
                $body
                next += one;
            }
        }
        #[cfg(small)]
        for $i in $first..$end $body
    };
}

/// `for i in N { body }` for the few coordinates of a measurement, or modes: always written out for the first four.
macro_rules! each {
    ($i:ident in $n:ident $body:block) => {
        written_out!(@ $i $n $body 0 1 2 3);
        for $i in 4..$n $body
    };
}
