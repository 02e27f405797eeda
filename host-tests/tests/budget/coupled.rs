//! The coupled filter: that it makes no more work than its formula is the test `coupled`'s; here, what that amounts to.

use super::{Outcome, published};
use boresight::tracker::Work;
use host_tests::budget::bound;
use twin::coupled::{Meeting, SCANS, plots};

#[test]
fn published_cycles_are_within_what_the_steps_of_their_scans_amount_to() -> Outcome {
    let published = published()?;
    for (form, functions) in published["coupled"]["forms"].as_table().ok_or("no forms")? {
        for (sensor, name) in ["radar", "infrared"].into_iter().enumerate() {
            let counted = functions[name]["worst_cycles"].as_integer().ok_or("no cycles")?;
            let most = (1..=SCANS).map(|k| Meeting::most(plots(sensor, k).1)).max_by_key(Work::steps).ok_or("no scans")?;
            // The infrared sensor looks when the radar has moved the targets.
            let predictions = if sensor == 0 { most.predictions } else { 0 };
            let amount = bound::coupled_cycles(&Work { predictions, ..most });
            println!("{form}, {name}: {counted} of {amount} cycles");
            assert!(counted > 0 && counted.unsigned_abs() <= amount, "{form}, {name}: {counted} of {amount} cycles");
            // Nor is the estimate idle.
            assert!(2 * counted.unsigned_abs() >= amount, "{form}, {name}: {counted} of {amount} cycles");
        }
    }
    Ok(())
}
