//! Motion models chosen at run time: the library's models behind one enum for each layout of the state.
//!
//! | enum | states | models |
//! |---|---|---|
//! | [`VelocityMode`] | position and velocity per axis | constant velocity, known turn |
//! | [`AccelerationMode`] | position, velocity and acceleration per axis | constant velocity, constant acceleration, Singer |
//!
//! An array of such modes is a mode set of the library. The equations stand in the models' own modules.

use super::config::{InitiationPlan, ModeConfig, Model, Noise};
use crate::Failure;
use boresight::error::ConfigError;
use boresight::gaussian::Gaussian;
use boresight::model::motion::{ConstantAcceleration, ConstantVelocity, ProcessNoise, Singer};
use boresight::model::turn::KnownTurn;
use boresight::model::{Layout, MotionModel};
use boresight::scalar::Real;
use boresight::symmetric::Symmetric;
use nalgebra::{SMatrix, SVector};

/// A kind of modes, made from their description.
pub(super) trait ModeKind: Sized + Copy {
    /// The mode that is described.
    fn build(config: &ModeConfig) -> Result<Self, Failure>;
}

/// A mode of states with position and velocity.
#[derive(Debug, Clone, Copy)]
pub(super) enum VelocityMode<T, const AXES: usize> {
    Straight(ConstantVelocity<T, AXES>),
    Turn(KnownTurn<T, AXES>),
}

/// A mode of states with position, velocity and acceleration.
#[derive(Debug, Clone, Copy)]
pub(super) enum AccelerationMode<T> {
    Straight(ConstantVelocity<T, 2, 3>),
    Acceleration(ConstantAcceleration<T, 2>),
    Singer(Singer<T, 2>),
}

impl<T: Real, const AXES: usize> ModeKind for VelocityMode<T, AXES> {
    fn build(config: &ModeConfig) -> Result<Self, Failure> {
        let noise = process_noise(config.noise()?);
        match config.model {
            Model::ConstantVelocity => ConstantVelocity::new(noise).map(Self::Straight).map_err(refused),
            Model::Turn => KnownTurn::new(T::lit(config.turn_rate()?), noise).map(Self::Turn).map_err(refused),
            Model::ConstantAcceleration | Model::Singer => Err(Failure::at_field("model", "wants the state \"ca-2d\"")),
        }
    }
}

impl<T: Real> ModeKind for AccelerationMode<T> {
    fn build(config: &ModeConfig) -> Result<Self, Failure> {
        let noise = config.noise()?;
        match (config.model, noise) {
            (Model::ConstantVelocity, _) => ConstantVelocity::new(process_noise(noise)).map(Self::Straight).map_err(refused),
            (Model::ConstantAcceleration, _) => ConstantAcceleration::new(process_noise(noise)).map(Self::Acceleration).map_err(refused),
            (Model::Singer, Noise::Step(std) | Noise::Density(std)) => {
                Singer::new(T::lit(config.time_constant()?), T::lit(std)).map(Self::Singer).map_err(refused)
            }
            (Model::Turn, _) => Err(Failure::at_field("model", "wants the state \"cv-2d\" or \"cv-3d\"")),
        }
    }
}

/// What no measurement tells of a new track, per axis: position 0 ± 0 (always measured), velocity 0 ± max_speed / 2,
/// acceleration 0 ± its standard deviation.
pub(super) fn prior<T: Real, const NX: usize>(layout: Layout, plan: &InitiationPlan) -> Gaussian<T, NX> {
    let deviations = [0.0, plan.max_speed / 2.0, plan.acceleration_std];
    let variance = |state: usize| deviations.get(state % layout.stride.max(1)).map_or(0.0, |deviation| deviation * deviation);
    Gaussian::new(SVector::zeros(), Symmetric::from_fn(|i, j| if i == j { T::lit(variance(i)) } else { T::ZERO }))
}

fn process_noise<T: Real>(noise: Noise) -> ProcessNoise<T> {
    match noise {
        Noise::Step(std) => ProcessNoise::Discrete(T::lit(std * std)),
        Noise::Density(density) => ProcessNoise::Continuous(T::lit(density)),
    }
}

fn refused(error: ConfigError) -> Failure {
    Failure::input(error)
}

/// Hands every function of the model over to the variant.
macro_rules! motion_model {
    ([$($generics:tt)*] $kind:ty, $layout:expr, $($variant:ident),+) => {
        impl<T: Real, const NX: usize, $($generics)*> MotionModel<T, NX> for $kind {
            const LAYOUT: Layout = $layout;
            type Step = T;

            fn transition(&self, x: &SVector<T, NX>, dt: T) -> SVector<T, NX> {
                match self { $(Self::$variant(model) => model.transition(x, dt)),+ }
            }
            fn jacobian(&self, x: &SVector<T, NX>, dt: T) -> SMatrix<T, NX, NX> {
                match self { $(Self::$variant(model) => model.jacobian(x, dt)),+ }
            }
            fn process_noise(&self, x: &SVector<T, NX>, dt: T) -> Symmetric<T, NX> {
                match self { $(Self::$variant(model) => model.process_noise(x, dt)),+ }
            }
            fn step(&self, dt: T) -> T {
                dt
            }
            fn advance(&self, g: &mut Gaussian<T, NX>, dt: &T) {
                match self { $(Self::$variant(model) => model.predict(g, *dt)),+ }
            }
        }
    };
}
motion_model!([const AXES: usize] VelocityMode<T, AXES>, Layout { axes: AXES, stride: 2 }, Straight, Turn);
motion_model!([] AccelerationMode<T>, Layout { axes: 2, stride: 3 }, Straight, Acceleration, Singer);

#[cfg(test)]
mod tests {
    use super::*;

    fn built<M: ModeKind>(mode: &str) -> Result<M, String> {
        let mode = toml::from_str(mode).map_err(|error| error.to_string())?;
        M::build(&mode).map_err(|failure| failure.to_string())
    }

    #[test]
    fn a_mode_moves_as_its_model() {
        let mode = built::<VelocityMode<f64, 2>>("model = \"turn\"\nturn_rate = 0.1\nacceleration_density = 0.3");
        let model = KnownTurn::<f64, 2>::new(0.1, ProcessNoise::Continuous(0.3));
        let mut got = Gaussian::<f64, 4>::new(SVector::from([1.0, 2.0, 3.0, 4.0]), Symmetric::from_diagonal([1.0; 4]));
        let mut expected = got;
        assert!(mode.is_ok_and(|mode| {
            mode.predict(&mut got, 1.68);
            true
        }));
        assert!(model.is_ok_and(|model| {
            model.predict(&mut expected, 1.68);
            true
        }));
        assert_eq!(got, expected);
        assert_eq!(<AccelerationMode<f32> as MotionModel<f32, 6>>::LAYOUT, <Singer<f32, 2> as MotionModel<f32, 6>>::LAYOUT);
    }

    #[test]
    fn a_model_and_a_state_that_do_not_fit_are_told() {
        let singer = "model = \"singer\"\ntime_constant = 9\nacceleration_std = 1";
        assert!(built::<AccelerationMode<f32>>(singer).is_ok());
        assert!(built::<VelocityMode<f32, 2>>(singer).is_err_and(|told| told == "model: wants the state \"ca-2d\""));
        let turn = "model = \"turn\"\nturn_rate = 0.1\nacceleration_std = 1";
        assert!(built::<AccelerationMode<f32>>(turn).is_err_and(|told| told.contains("cv-3d")));
    }
}
