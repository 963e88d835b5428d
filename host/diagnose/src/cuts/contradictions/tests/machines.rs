//! Machines whose records are spoiled.

use std::path::Path;

use crate::tests::virtual_records::record;
use quietcut_model::case::Case;
use quietcut_recording::{Quantity, Recording};
use quietcut_simulate::{Effects, Entry, VirtualCut};

/// Matrices of a soft robot, natural frequencies of 20.0 and 17.4 Hz.
const ROBOT: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[97.0, 5.9], [5.9, 188.0]]
damping = [[548.0, 23.4], [23.4, 306.0]]
stiffness = [[1540000.0, 0.0], [0.0, 2260000.0]]
"#;

/// Two modes of a tool, 890 and 1010 Hz.
const TOOL: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y"]
mass = [[0.32, 0.0], [0.0, 0.30]]
damping = [[140.0, 4.0], [4.0, 120.0]]
stiffness = [[10000000.0, 0.0], [0.0, 12000000.0]]
"#;

/// Three directions, a spindle with modes at 400 to 700 Hz.
const SPINDLE: &str = r#"
[structure]
kind = "matrices"
directions = ["x", "y", "z"]
mass = [[2.0, 0.0, 0.0], [0.0, 2.4, 0.1], [0.0, 0.1, 3.0]]
damping = [[400.0, 0.0, 0.0], [0.0, 500.0, 0.0], [0.0, 0.0, 900.0]]
stiffness = [[20000000.0, 500000.0, 0.0], [500000.0, 15000000.0, 0.0], [0.0, 0.0, 60000000.0]]
"#;

/// A machine, its job and its sensors.
#[derive(Clone, Copy, Debug)]
pub(super) struct Machine {
    pub name: &'static str,
    structure: &'static str,
    pub teeth: usize,
    edge_angle_deg: f64,
    /// Tangential, radial and axial cutting coefficient, MPa.
    mpa: [f64; 3],
    pub engagement_deg: [f64; 2],
    feed_mm: f64,
    /// Speeds, rev/min, and depths, mm, of the cuts.
    cuts: [[f64; 2]; 2],
    rate_hz: f64,
    seconds: f64,
    measured: &'static [Quantity],
}

const ALL_SENSORS: &[Quantity] = &[Quantity::Force, Quantity::Acceleration];

/// Machines from a soft robot to a stiff tool.
pub(super) const MACHINES: [Machine; 7] = [
    Machine {
        name: "robot, 2 teeth, down, forces",
        structure: ROBOT,
        teeth: 2,
        edge_angle_deg: 90.0,
        mpa: [76.0, 12.0, 0.0],
        engagement_deg: [90.0, 180.0],
        feed_mm: 0.15,
        cuts: [[900.0, 0.8], [1230.0, 0.6]],
        rate_hz: 2048.0,
        seconds: 4.0,
        measured: &[Quantity::Force, Quantity::Displacement],
    },
    Machine {
        name: "robot, 3 teeth, up, displacements",
        structure: ROBOT,
        teeth: 3,
        edge_angle_deg: 90.0,
        mpa: [120.0, 40.0, 0.0],
        engagement_deg: [0.0, 80.0],
        feed_mm: 0.1,
        cuts: [[700.0, 0.8], [900.0, 0.8]],
        rate_hz: 2048.0,
        seconds: 4.0,
        measured: &[Quantity::Displacement],
    },
    Machine {
        name: "tool, 4 teeth, up, forces",
        structure: TOOL,
        teeth: 4,
        edge_angle_deg: 90.0,
        mpa: [700.0, 250.0, 0.0],
        engagement_deg: [0.0, 60.0],
        feed_mm: 0.08,
        cuts: [[3000.0, 0.5], [3900.0, 0.4]],
        rate_hz: 12800.0,
        seconds: 1.0,
        measured: ALL_SENSORS,
    },
    Machine {
        name: "tool, 1 tooth, down, forces",
        structure: TOOL,
        teeth: 1,
        edge_angle_deg: 90.0,
        mpa: [700.0, 250.0, 0.0],
        engagement_deg: [120.0, 180.0],
        feed_mm: 0.08,
        cuts: [[6000.0, 0.5], [7700.0, 0.4]],
        rate_hz: 12800.0,
        seconds: 1.0,
        measured: ALL_SENSORS,
    },
    Machine {
        name: "tool, 3 teeth, slot, accelerations",
        structure: TOOL,
        teeth: 3,
        edge_angle_deg: 90.0,
        mpa: [700.0, 250.0, 0.0],
        engagement_deg: [0.0, 180.0],
        feed_mm: 0.08,
        cuts: [[3000.0, 0.3], [3900.0, 0.2]],
        rate_hz: 12800.0,
        seconds: 1.0,
        measured: &[Quantity::Acceleration],
    },
    Machine {
        name: "spindle, 2 teeth, up, forces",
        structure: SPINDLE,
        teeth: 2,
        edge_angle_deg: 60.0,
        mpa: [1500.0, 600.0, 250.0],
        engagement_deg: [0.0, 110.0],
        feed_mm: 0.12,
        cuts: [[2400.0, 0.5], [3300.0, 0.5]],
        rate_hz: 8192.0,
        seconds: 1.6,
        measured: ALL_SENSORS,
    },
    Machine {
        name: "tool, 2 teeth, down, accelerations",
        structure: TOOL,
        teeth: 2,
        edge_angle_deg: 90.0,
        mpa: [700.0, 250.0, 0.0],
        engagement_deg: [130.0, 180.0],
        feed_mm: 0.08,
        cuts: [[5000.0, 0.5], [6100.0, 0.4]],
        rate_hz: 12800.0,
        seconds: 1.0,
        measured: &[Quantity::Acceleration],
    },
];

impl Machine {
    /// The case.
    pub(super) fn case(&self) -> Case {
        self.case_with_feed(self.feed_mm)
    }

    fn case_with_feed(&self, feed_mm: f64) -> Case {
        let [ktc, krc, kac] = self.mpa;
        let [start, exit] = self.engagement_deg;
        let text = format!(
            "{}\n[tool]\nteeth = {}\nedge_angle_deg = {}\ndiameter_mm = 12.0\n[material]\nktc_mpa = {ktc}\nkrc_mpa = {krc}\nkac_mpa = {kac}\nkte_n_per_mm = 0.0\nkre_n_per_mm = 0.0\nkae_n_per_mm = 0.0\n[cut]\nstart_deg = {start}\nexit_deg = {exit}\nfeed_per_tooth_mm = {feed_mm}\n",
            self.structure, self.teeth, self.edge_angle_deg
        );
        Case::parse(Path::new("baseline.toml"), &text).unwrap()
    }

    /// This machine with a tool of other teeth.
    pub(super) fn with_teeth(self, teeth: usize) -> Self {
        Self { teeth, ..self }
    }

    /// An effect with sizes of this machine.
    pub(super) fn filled(&self, effect: &str) -> String {
        let is_soft = self.structure == ROBOT;
        let motion = if self.measured.contains(&Quantity::Displacement) {
            "x"
        } else {
            "ax"
        };
        let [frequency, mass, friction, cubic] = if is_soft {
            ["35", "120", "1", "5e11"]
        } else {
            ["1500", "0.4", "3", "1e16"]
        };
        effect
            .replace("MOTION", motion)
            .replace("FREQUENCY", frequency)
            .replace("MASS", mass)
            .replace("FRICTION", friction)
            .replace("CUBIC", cubic)
    }

    /// Two cuts with hidden effects and noise; `None` if they cannot be simulated or do not stay bounded.
    pub(super) fn try_records(&self, effects: &[&str], noise: f64, seed: u64) -> Option<Vec<Recording>> {
        Effects::parse_over(effects.iter().copied(), Some(self.seconds)).ok()?;
        let records = std::panic::catch_unwind(|| self.records(effects, noise, seed)).ok()?;
        let is_finite = |record: &Recording| {
            record
                .channels
                .iter()
                .all(|channel| channel.samples.iter().all(|sample| sample.is_finite()))
        };
        records.iter().all(is_finite).then_some(records)
    }

    /// Two cuts with hidden effects and noise.
    pub(super) fn records(&self, effects: &[&str], noise: f64, seed: u64) -> Vec<Recording> {
        self.cuts
            .into_iter()
            .zip([1.0, 0.7])
            .enumerate()
            .map(|(index, ([rpm, depth_mm], feed))| {
                let cut = VirtualCut {
                    effects: Effects::parse_over(effects.iter().copied(), Some(self.seconds)).unwrap(),
                    entry: Entry::None,
                    measured: self.measured.to_vec(),
                    ..VirtualCut::new(rpm, depth_mm, self.seconds)
                };
                let case = self.case_with_feed(feed * self.feed_mm);
                record(
                    &case,
                    &cut,
                    &format!("cut-{index}.csv"),
                    self.rate_hz,
                    noise,
                    seed + index as u64,
                )
            })
            .collect()
    }
}
