//! Error rates of the chatter detector over many noise seeds.
//!
//! Prints the whole table, with QUIETCUT_SEEDS seeds per line (20 take some minutes). With `QUIETCUT_LINES=shaken` it prints
//! only the lines whose name contains this text:
//!
//! ```text
//! QUIETCUT_SEEDS=20 cargo test --release -p quietcut-tests --test detector_rates -- --ignored --nocapture
//! ```

#![allow(clippy::unwrap_used)]

use quietcut_testkit::results::Campaign;
use quietcut_tests::acceptance::LIMITS;
use quietcut_tests::campaign::{Line, Rates, run};

/// Largest ratio of the vibration to the forced vibration at the first alarm.
const IN_TIME: f64 = 5.0;

/// Largest allowed error of the chatter frequency in the first alarm, Hz: at 1100 rev/min, where the aliases lie closest together, they are 1.3 Hz apart.
const SAME_HZ: f64 = 0.5;

/// Prints every line; no line may have a wrong alarm, a late alarm, or an alarm at another frequency.
fn check(rates: &[Rates]) {
    for line in rates {
        println!("{line}");
    }
    for line in rates {
        assert_eq!(line.wrong(), 0, "{line}");
        if line.has_chatter() {
            assert_eq!(line.in_time(IN_TIME), line.cuts(), "{line}");
            assert!(line.frequency_error_hz() < SAME_HZ, "{line}");
        }
    }
}

#[test]
fn verdicts_on_hard_cuts_are_right_with_other_seeds() {
    // Three speeds: the flip, the torus with slow growth next to it, and the largest forced vibration.
    let lines = [3, 4, 9].into_iter().flat_map(Line::pair);
    check(&run(lines.collect(), 4));
}

#[test]
#[ignore = "takes minutes: see the head of the file"]
fn table() {
    let seeds = std::env::var("QUIETCUT_SEEDS").map_or(20, |text| text.parse().unwrap());
    let mut lines: Vec<Line> = (0..LIMITS.len()).flat_map(Line::pair).collect();
    for teeth in [2, 4, 6] {
        lines.extend([10.0, 50.0].map(|offset_um| Line::runout(teeth, offset_um)));
    }
    lines.extend([2, 3, 6].map(|index| Line::ramp(index, 40.0)));
    for index in [2, 3, 7, 9] {
        lines.extend([0.02, 0.1].map(|force| Line::shaken(index, force)));
    }
    lines.extend([2, 3, 9].map(|index| Line::noisy(index, 2.0)));
    let wanted = std::env::var("QUIETCUT_LINES").unwrap_or_default();
    lines.retain(|line| line.name.contains(&wanted));
    let rates = run(lines, seeds);
    let figures: Vec<_> = rates
        .iter()
        .map(|line| (line.name().to_owned(), line.findings()))
        .collect();
    Campaign {
        name: "detector-rates",
        title: "Detector",
        command: &format!(
            "QUIETCUT_SEEDS={seeds} cargo test --release -p quietcut-tests --test detector_rates -- --ignored --nocapture"
        ),
        seeds: &format!("0 to {} for each line", seeds - 1),
    }
    .record(&figures);
    check(&rates);
}
