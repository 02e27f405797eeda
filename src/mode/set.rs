//! The set of modes a target moves in: a tuple of different models, or an array of one kind.
//!
//! A tuple keeps each model its own type, so that every prediction is its own straight-line code; an array serves
//! many modes of one model (turn rates), and modes chosen at run time behind an enum.

use crate::gaussian::Gaussian;
use crate::model::{Layout, MotionModel};
use crate::scalar::Real;
use nalgebra::{SMatrix, SVector};

/// `MODES` motion models over one state of `NX` entries.
pub trait ModeSet<T: Real, const NX: usize, const MODES: usize> {
    /// Where positions and velocities stand, the same in all modes.
    const LAYOUT: Layout;

    /// The steps of all models.
    type Steps;

    /// The steps over `dt` \[s\].
    fn steps(&self, dt: T) -> Self::Steps;
    /// Predicts `g` by the step of the model number `mode`; a number beyond the last does nothing.
    fn advance(&self, mode: usize, g: &mut Gaussian<T, NX>, steps: &Self::Steps);
    /// Predicts every mode by its step.
    #[inline(always)]
    fn advance_all(&self, modes: &mut [Gaussian<T, NX>; MODES], steps: &Self::Steps) {
        for (mode, g) in modes.iter_mut().enumerate() {
            self.advance(mode, g, steps);
        }
    }
    /// v ← F v by the model number `mode` over `dt` \[s\], F at `x`; a number beyond the last does nothing.
    fn propagate(&self, mode: usize, x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T);
}

impl<T: Real, M: MotionModel<T, NX>, const NX: usize, const MODES: usize> ModeSet<T, NX, MODES> for [M; MODES] {
    const LAYOUT: Layout = {
        assert!(M::LAYOUT.fits(NX), "the state is too short for this model");
        M::LAYOUT
    };
    type Steps = [M::Step; MODES];

    #[inline(always)]
    fn steps(&self, dt: T) -> [M::Step; MODES] {
        self.each_ref().map(|model| model.step(dt))
    }
    #[inline(always)]
    fn advance(&self, mode: usize, g: &mut Gaussian<T, NX>, steps: &[M::Step; MODES]) {
        if let Some((model, step)) = self.get(mode).zip(steps.get(mode)) {
            model.advance(g, step);
        }
    }
    #[inline(always)]
    fn propagate(&self, mode: usize, x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
        if let Some(model) = self.get(mode) {
            model.propagate(x, v, dt);
        }
    }
}

macro_rules! tuple_of_modes {
    ($count:literal: $first:ident $(, $model:ident $index:tt)*) => {
        impl<T: Real, const NX: usize, $first: MotionModel<T, NX> $(, $model: MotionModel<T, NX>)*> ModeSet<T, NX, $count>
            for ($first, $($model,)*)
        {
            const LAYOUT: Layout = {
                assert!($first::LAYOUT.fits(NX), "the state is too short for this model");
                $(assert!($first::LAYOUT.agrees($model::LAYOUT), "modes disagree on where positions stand");)*
                $first::LAYOUT
            };
            type Steps = ($first::Step, $($model::Step,)*);

            #[inline(always)]
            fn steps(&self, dt: T) -> Self::Steps {
                (self.0.step(dt), $(self.$index.step(dt),)*)
            }
            #[inline(always)]
            fn advance(&self, mode: usize, g: &mut Gaussian<T, NX>, steps: &Self::Steps) {
                match mode {
                    0 => self.0.advance(g, &steps.0),
                    $($index => self.$index.advance(g, &steps.$index),)*
                    _ => {}
                }
            }
            #[inline(always)]
            fn advance_all(&self, modes: &mut [Gaussian<T, NX>; $count], steps: &Self::Steps) {
                self.0.advance(&mut modes[0], &steps.0);
                $(self.$index.advance(&mut modes[$index], &steps.$index);)*
            }
            #[inline(always)]
            fn propagate(&self, mode: usize, x: &SVector<T, NX>, v: &mut SMatrix<T, NX, NX>, dt: T) {
                match mode {
                    0 => self.0.propagate(x, v, dt),
                    $($index => self.$index.propagate(x, v, dt),)*
                    _ => {}
                }
            }
        }
    };
}
tuple_of_modes!(1: A);
tuple_of_modes!(2: A, B 1);
tuple_of_modes!(3: A, B 1, C 2);
tuple_of_modes!(4: A, B 1, C 2, D 3);
tuple_of_modes!(5: A, B 1, C 2, D 3, E 4);
tuple_of_modes!(6: A, B 1, C 2, D 3, E 4, F 5);
tuple_of_modes!(7: A, B 1, C 2, D 3, E 4, F 5, G 6);
