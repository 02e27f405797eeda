//! From sizes read in a file to const generics.

/// Calls `solver::<T, sizes..>(case)` with `T` by the precision and the constants that equal the given sizes; fails
/// with a message that names them where the combination is not in the list. Every combination is compiled once per
/// precision, so the lists hold what cases use.
///
/// `by_size!(precision, solver(case), [n, m]: [4 2] [6 2])`
macro_rules! by_size {
    ($precision:expr, $solver:ident($case:expr), $sizes:expr, $([$($N:literal)+])+) => {
        match ($precision, $sizes) {
            $(
                ($crate::Precision::F32, [$($N),+]) => $solver::<f32, $($N),+>($case),
                ($crate::Precision::F64, [$($N),+]) => $solver::<f64, $($N),+>($case),
            )+
            (_, sizes) => Err($case.failure(format!("sizes {sizes:?} are not among those that were built"))),
        }
    };
}
pub(super) use by_size;
