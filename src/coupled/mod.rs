//! Two targets as one: densities that keep what the targets have in common, and what a scan says of both.
//!
//! ```text
//! state        x = (x₁, x₂),   P = [P₁ C; C' P₂]                     by blocks, of which P's upper ones are stored
//! measurement  h = (h(x₁), h(x₂)),   G = P H',   Σ = H P H',   H = diag(H₁, H₂)
//! hypothesis   measures A h with the noise R_A:   S = A Σ A' + R_A,   w = A' S⁻¹ ν,   E = A' S⁻¹ A
//! correction   x ← x + G w̄,   P ← P − G Ē G',   w̄ = Σ p w,   Ē = Σ p (E − w w') + w̄ w̄'
//! ```
//!
//! Two targets become dependent when they share detections: what is one's is not the other's, and what is of both ties them. Every
//! hypothesis on a scan (`hypotheses.rs`) is a Kalman update of the whole state by the full gain, and all of them live in the space
//! of the two measurements: whatever their number, the state is corrected once. Jeong and Tugnait, *IEE Proc. Radar Sonar Navig.*
//! 152(5), 2005, equations 24 to 60, after Bar-Shalom and Fortmann 1988; what is printed there for detections of one target moves
//! that target alone, by a gain that leaves no covariance.
//!
//! | file | of what |
//! |---|---|
//! | `gaussian.rs` | the density of both targets in one pair of modes: prediction, predicted measurements, correction |
//! | `blocks.rs` | vectors and symmetric matrices over two measurements |
//! | `hypotheses.rs` | what the detections of a scan may be, weighed by logarithms |
//! | `as_one.rs` | two targets that the sensor sees as one |
//! | `sums.rs` | what hypotheses add up to |
//! | `bank.rs` | one density for every pair of modes, and the interacting multiple model cycle on them |

pub(crate) mod as_one;
mod bank;
mod blocks;
mod gaussian;
mod hypotheses;
mod sums;

pub use bank::CoupledBank;
pub use blocks::{Blocks, Pair};
pub use gaussian::{CoupledGaussian, CoupledInnovation, Coupling, Cross, NoCross};
pub use hypotheses::{Candidate, Event, Hypothesis, Odds};
pub use sums::Sums;
