//! Microslip of joints, hidden and found again.

use crate::Options;
use crate::conclusion::answer::{Diagnosis, Outcome};
use crate::diagnose;
use crate::tests::structure::{baseline, decays, random_seed, recorded_of, sweeps};
use quietcut_model::structure::Direction;
use quietcut_recording::{Recording, TestKind};
use quietcut_simulate::rig::{Impact, Signal};

/// Displacement, m, at which the tests state the softening of a joint.
const REFERENCE_M: f64 = 1e-4;

/// A hidden joint: softening at [`REFERENCE_M`], N/m, exponent, and displacement of complete slip, m, with β.
struct Joint {
    softening: f64,
    exponent: f64,
    slip: Option<[f64; 2]>,
}

impl Joint {
    const fn microslip(softening: f64, exponent: f64) -> Self {
        Self {
            softening,
            exponent,
            slip: None,
        }
    }

    fn texts(&self) -> Vec<String> {
        let mut texts = vec![
            format!("joint-friction={}", self.softening),
            format!("joint-friction.exponent={}", self.exponent),
            format!("joint-friction.reference_m={REFERENCE_M:e}"),
        ];
        if let Some([slip_m, beta]) = self.slip {
            texts.push(format!("joint-friction.slip_m={slip_m:e}"));
            texts.push(format!("joint-friction.beta={beta}"));
        }
        texts
    }

    /// Records with this joint, and their diagnosis, which must name it alone.
    fn found_in(&self, records: fn(&[&str], u64) -> Vec<Recording>) -> Diagnosis {
        let texts = self.texts();
        let texts: Vec<&str> = texts.iter().map(String::as_str).collect();
        let records = records(&texts, random_seed());
        let answer = diagnose(&baseline(), &records, &Options::default()).unwrap();
        println!(
            "{:?} {:?} {:?}",
            answer.outcome, answer.equivalent, answer.warnings
        );
        for cause in &answer.causes {
            println!("{} {:?}", cause.name, cause.parameters);
        }
        let names: Vec<&str> = answer.causes.iter().map(|cause| cause.name).collect();
        assert_eq!(names, ["joint-friction"], "{:?}", answer.causes);
        assert_eq!(answer.outcome, Outcome::Cause);
        self.has_parameters(&answer);
        answer
    }

    fn has_parameters(&self, answer: &Diagnosis) {
        let parameters = &answer.causes[0].parameters;
        let scale = parameters["reference_m"].value / REFERENCE_M;
        let mut wanted = vec![
            ("softening_n_per_m", self.softening * scale.powf(self.exponent)),
            ("exponent", self.exponent),
        ];
        if let Some([slip_m, beta]) = self.slip {
            wanted.extend([("slip_m", slip_m), ("beta", beta)]);
        }
        assert_eq!(parameters.contains_key("slip_m"), self.slip.is_some());
        for (key, truth) in wanted {
            let figure = parameters[key];
            let half_width = 0.5 * (figure.ci90[1] - figure.ci90[0]);
            // An exponent of 1 is at its bound, where the interval has no width.
            let apart = (figure.value - truth).abs();
            println!("{key}: {figure:?} of {truth}");
            assert!(apart <= 3.0 * half_width, "{key}: {figure:?} of {truth}");
        }
    }
}

#[test]
fn a_joint_is_found_at_three_levels() {
    for (softening, exponent) in [(1e5, 0.5), (5e4, 0.8)] {
        Joint::microslip(softening, exponent).found_in(sweeps);
    }
}

#[test]
fn a_joint_is_found_in_free_decays() {
    for (softening, exponent) in [(4e4, 0.5), (3e4, 0.8), (2e4, 1.0)] {
        Joint::microslip(softening, exponent).found_in(decays);
    }
}

#[test]
fn a_joint_is_found_in_impacts() {
    let impacts = |texts: &[&str], seed| {
        let impact = |(seed, peak_n)| {
            let signal = Signal::Impacts {
                impacts: vec![Impact {
                    start_s: 0.5,
                    peak_n,
                    pulse_s: 0.02,
                }],
                seconds: 4.0,
            };
            // Samples of a half sine without a filter before them add up to less than its impulse by (π/82)²/12 = 1.2e-4: less than
            // the noise leaves of the amplitude.
            let mut record = recorded_of(&baseline(), Direction::X, signal, 4096.0, texts, seed);
            record.sidecar.kind = Some(TestKind::Hammer);
            record
        };
        [(seed, 300.0), (seed + 1, 1000.0), (seed + 2, 3000.0)]
            .map(impact)
            .into()
    };
    Joint::microslip(4e4, 0.6).found_in(impacts);
}

#[test]
fn a_joint_is_found_in_tones_at_three_levels() {
    let tones = |texts: &[&str], seed| {
        let steady = |(seed, amplitude_n)| {
            let signal = Signal::tones(&[14.3, 16.1, 17.2, 18.7], [amplitude_n; 2], 20.0, seed);
            let mut record = recorded_of(&baseline(), Direction::X, signal, 256.0, texts, seed);
            record.sidecar.kind = Some(TestKind::Shaker);
            record
        };
        [(seed, 3.0), (seed + 1, 10.0), (seed + 2, 30.0)]
            .map(steady)
            .into()
    };
    Joint::microslip(4e4, 0.6).found_in(tones);
}

#[test]
fn slip_of_the_whole_joint_is_found_if_it_is_seen() {
    Joint {
        softening: 4e4,
        exponent: 0.6,
        slip: Some([1.5e-4, 0.5]),
    }
    .found_in(sweeps);
}
