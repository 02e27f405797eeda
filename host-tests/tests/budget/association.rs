//! The work of joint association against the formula of its worst case.

use super::COUNTER;
use boresight::association::{AssociationMatrix, Associator, ClutterPrior, Domain, Gnn, Jpda, take_operations};
use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// The most steps of `associator` over `count` matrices, as a share of `formula`.
fn load<A: Associator<f32, TRACKS, DETS>, const TRACKS: usize, const DETS: usize>(
    associator: &A,
    formula: u64,
    count: usize,
    rng: &mut impl Rng,
) -> f64 {
    let mut memory = Box::new(A::MEMORY);
    let mut matrix = Box::new(AssociationMatrix::<f32, TRACKS, DETS>::new());
    let mut worst = 0;
    for i in 0..count {
        let clutter = if i % 3 == 0 { ClutterPrior::Diffuse } else { ClutterPrior::Poisson };
        matrix.reset(DETS, clutter, Domain::Linear);
        // From all equal to hopelessly wide, from a few pairs to all.
        let (spread, density) = ([0.0, 1.0, 6.0, 30.0][i % 4], [0.1, 0.4, 1.0][i / 4 % 3]);
        for t in 0..TRACKS {
            let Some((miss, hit)) = matrix.row_mut(t) else { continue };
            *miss = if i % 5 == 0 { 0.0 } else { 10f32.powf(-rng.random_range(0.0..=spread)) };
            hit.fill_with(|| if rng.random_bool(density) { 10f32.powf(rng.random_range(-spread..=spread)) } else { 0.0 });
        }
        take_operations();
        associator.associate(&mut matrix, &mut memory);
        worst = worst.max(take_operations() as u64);
    }
    worst as f64 / formula as f64
}

/// The same of a [`Jpda`] that refuses nothing but the bounded answer: every rung is climbed.
fn jpda<const TRACKS: usize, const DETS: usize, const NODES: usize>(count: usize, rng: &mut impl Rng) -> f64 {
    let strict = Jpda::<NODES>::new().with_tolerance(0.0).unwrap_or_default();
    load::<_, TRACKS, DETS>(&strict, Jpda::<NODES>::worst_case(TRACKS, DETS), count, rng)
}

fn gnn<const TRACKS: usize, const DETS: usize>(count: usize, rng: &mut impl Rng) -> f64 {
    load::<_, TRACKS, DETS>(&Gnn, Gnn::worst_case(TRACKS, DETS), count, rng)
}

#[test]
fn no_matrix_takes_more_steps_than_the_formula() {
    let _alone = COUNTER.lock();
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let shares = [
        jpda::<1, 1, 2>(20, &mut rng),
        jpda::<4, 8, 9>(200, &mut rng),
        jpda::<4, 8, 128>(200, &mut rng),
        jpda::<16, 32, 33>(200, &mut rng),
        jpda::<16, 32, 512>(100, &mut rng),
        jpda::<26, 64, 128>(60, &mut rng),
        jpda::<64, 64, 65>(60, &mut rng),
        jpda::<64, 64, 256>(30, &mut rng),
        gnn::<1, 1>(20, &mut rng),
        gnn::<4, 8>(200, &mut rng),
        gnn::<16, 32>(200, &mut rng),
        gnn::<64, 64>(60, &mut rng),
    ];
    println!("largest share of the formula: {shares:.3?}");
    assert!(shares.iter().all(|share| *share > 0.0 && *share <= 1.0), "{shares:?}");
}
