//! Cases and records that contradict each other.

mod faults;
mod machines;

use faults::Fault;
use machines::MACHINES;

use super::contradiction;
use crate::baseline::Baseline;
use crate::cuts::record::ReducedCut;
use crate::records::checks;
use quietcut_model::case::Case;
use quietcut_recording::Quantity::{Acceleration, Displacement, Force};
use quietcut_recording::Recording;

/// The faults that are tried with every machine.
fn faults() -> Vec<Fault> {
    let mut all = vec![
        Fault::Teeth(1),
        Fault::Teeth(2),
        Fault::Teeth(3),
        Fault::Teeth(4),
        Fault::Teeth(6),
        Fault::Engagement(0.0, -30.0),
        Fault::Engagement(20.0, 0.0),
        Fault::UpForDown,
        Fault::Rotation,
        Fault::Air,
        Fault::MissedPulses(12),
        Fault::DoubledPulses(9),
        Fault::Clock(1.02),
        Fault::NotANumber(0),
        Fault::TwoTools,
    ];
    for quantity in [Force, Displacement, Acceleration] {
        all.extend([
            Fault::Swapped(quantity),
            Fault::Inverted(quantity, 0),
            Fault::Inverted(quantity, 1),
            Fault::AllInverted(quantity),
            Fault::Scaled(quantity, 0, 9.80665),
            Fault::Scaled(quantity, 1, 1e3),
            Fault::Scaled(quantity, 0, 1.0 / 9.80665),
            Fault::Scaled(quantity, 0, 4.448),
            Fault::AllScaled(quantity, 1e-3),
            Fault::AllScaled(quantity, 9.80665),
            Fault::Clipped(quantity, 0.6),
        ]);
    }
    all
}

/// The refusal of case and records, by the checks that come before causes are sought.
fn refusal(case: &Case, records: &[Recording]) -> Option<String> {
    let checked = records.iter().try_for_each(|record| {
        checks::signals(record)?;
        checks::cut(case, record)
    });
    if let Err(error) = checked {
        return Some(error.to_string());
    }
    let baseline = Baseline::new(case).unwrap();
    let reduced: Vec<ReducedCut> =
        records.iter().map(|record| ReducedCut::new(&baseline, record).unwrap()).collect();
    let start = std::time::Instant::now();
    let found = contradiction(&baseline, &reduced, records).map(|error| error.to_string());
    if start.elapsed().as_secs_f64() > 0.5 {
        println!("  {:.3} s", start.elapsed().as_secs_f64());
    }
    found
}

#[test]
#[ignore = "table"]
fn table() {
    let wanted = std::env::var("QUIETCUT_BAD").unwrap_or_default();
    let only: Option<usize> = std::env::var("QUIETCUT_MACHINE").ok().and_then(|text| text.parse().ok());
    for (index, machine) in MACHINES.iter().enumerate() {
        if only.is_some_and(|only| only != index) {
            continue;
        }
        let hidden = ["force-coefficients=0.08", "stiffness=0.03"];
        let good = machine.records(&hidden, 0.01, 5);
        let other_teeth = if machine.teeth == 2 { 3 } else { 2 };
        let other = machine.with_teeth(other_teeth).records(&hidden, 0.01, 9);
        println!("## {} ({} samples)", machine.name, good[0].len());
        println!("nothing: {:?}", refusal(&machine.case(), &good));
        for fault in faults() {
            let label = format!("{fault:?}");
            if !wanted.split('|').any(|wanted| label.contains(wanted)) {
                continue;
            }
            let (mut case, mut records) = (machine.case(), good.clone());
            if fault.spoil(&mut case, &mut records, &other).is_none() {
                continue;
            }
            println!("{label}: {}", refusal(&case, &records).unwrap_or_else(|| "MISSED".into()));
        }
    }
}

/// Causes of each kind that must not be taken for a wrong input.
const CAUSES: [&[&str]; 22] = [
    &["force-coefficients=0.5"],
    &["force-coefficients=-0.4"],
    &["stiffness=0.3"],
    &["stiffness=-0.3"],
    &["mass=0.3"],
    &["damping=0.8"],
    &["damping=-0.5"],
    &["runout=30", "runout.angle_deg=70"],
    &["runout=60", "runout.angle_deg=200"],
    &["edge-force=8", "edge-force.kre_n_per_mm=5"],
    &["force-exponent=0.6", "force-exponent.reference_chip_mm=0.1"],
    &["process-damping=2e5"],
    &["sensor-gain=1.3", "sensor-gain.channel=MOTION"],
    &["sensor-gain=0.7", "sensor-gain.channel=MOTION"],
    &["sensor-delay=2e-4", "sensor-delay.channel=MOTION"],
    &["cross-axis=0.2", "cross-axis.channel=MOTION", "cross-axis.from=y"],
    &["missing-mode=FREQUENCY", "missing-mode.direction=x", "missing-mode.damping_ratio=0.03", "missing-mode.modal_mass_kg=MASS"],
    &["coulomb-friction=FRICTION", "coulomb-friction.direction=y"],
    &["cubic-stiffness=CUBIC", "cubic-stiffness.direction=x"],
    &["cubic-stiffness=-CUBIC", "cubic-stiffness.direction=y"],
    &["wear=0.3"],
    &["drift=-0.2"],
];

#[test]
#[ignore = "table"]
fn causes() {
    let only: Option<usize> = std::env::var("QUIETCUT_MACHINE").ok().and_then(|text| text.parse().ok());
    let (mut tried, mut refused) = (0, 0);
    for (index, machine) in MACHINES.iter().enumerate() {
        if only.is_some_and(|only| only != index) {
            continue;
        }
        println!("## {}", machine.name);
        for effects in CAUSES {
            for seed in [3, 4] {
                let effects: Vec<String> = effects.iter().map(|effect| machine.filled(effect)).collect();
                let effects: Vec<&str> = effects.iter().map(String::as_str).collect();
                let Some(records) = machine.try_records(&effects, 0.02, seed) else {
                    println!("{effects:?}: NOT POSSIBLE");
                    continue;
                };
                tried += 1;
                let found = refusal(&machine.case(), &records);
                refused += usize::from(found.is_some());
                println!("{effects:?}: {found:?}");
            }
        }
    }
    println!("{refused} of {tried} refused");
}
