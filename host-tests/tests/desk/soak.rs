//! A short life of every ready tracker under all faults; the command `soak` makes it long.

use host_tests::soak::live;

#[test]
fn trackers_live_through_faults() {
    for number in 0..4 {
        let life = live(number, 8_000, 77).unwrap();
        assert_eq!(life.fault, None);
        // Every check has had something to check.
        assert!(life.refused > 100 && life.births > 100 && life.dropped > 100 && life.filled >= 2 && life.most == 16, "{life:?}");
        let [first, last] = life.followed.map(|[of, all]| of as f64 / all as f64);
        assert!(first > 0.8 && last > 0.8, "{life:?}");
    }
}
