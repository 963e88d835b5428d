//! Virtual cuts through the pipeline: what it says, and how large the vibration is when it says so.

use std::fmt;

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, Model, Regeneration, Room, Settings, TachometerModel, VirtualCut};
use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{Monitor, State};

use crate::acceptance::settings;
use crate::said::steps;

/// What came of a cut.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// In full cut from and to, s.
    pub full_cut_s: [f64; 2],
    /// Every verdict that differs from the one before: when, what, with which chatter frequency in Hz.
    pub verdicts: Vec<(f64, Verdict, Option<f32>)>,
    /// Largest displacement in each turn of the spindle over that of the forced motion in full cut: end of the turn in
    /// s, ratio.
    pub growth: Vec<(f64, f64)>,
}

impl Outcome {
    /// The first chatter that was called: when, what.
    pub fn first_alarm(&self) -> Option<(f64, Verdict)> {
        let alarm = self.verdicts.iter().find(|(_, verdict, _)| verdict.is_chatter());
        alarm.map(|(t, verdict, _)| (*t, *verdict))
    }

    /// When the vibration first was this many times the forced one, s.
    pub fn grown_to(&self, ratio: f64) -> Option<f64> {
        self.growth.iter().find(|turn| turn.1 > ratio).map(|turn| turn.0)
    }

    /// Size of the vibration over the forced one at `t`.
    pub fn ratio_at(&self, t: f64) -> f64 {
        self.growth
            .iter()
            .find(|turn| turn.0 >= t)
            .map_or(0.0, |turn| turn.1)
    }
}

impl fmt::Display for Outcome {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [from, to] = self.full_cut_s;
        write!(
            f,
            "{} rev/min {:.3} mm, full cut {from:.2} to {to:.2} s: ",
            self.rpm, self.depth_mm
        )?;
        match self.first_alarm() {
            None => write!(f, "no alarm")?,
            Some((t, verdict)) => write!(f, "{verdict:?} at {t:.2} s, ratio {:.2}", self.ratio_at(t))?,
        }
        let largest = self.growth.iter().fold(0.0_f64, |a, turn| a.max(turn.1));
        write!(
            f,
            "; five times at {:.2?} s, largest {largest:.2}; ",
            self.grown_to(5.0)
        )?;
        for (t, verdict, chatter) in &self.verdicts {
            write!(f, "{t:.2} {verdict:?}")?;
            if let Some(chatter) = chatter {
                write!(f, " {chatter:.1} Hz")?;
            }
            write!(f, ", ")?;
        }
        Ok(())
    }
}

/// Cuts `case`, with these sensors, and lets the pipeline judge.
pub fn judged(
    case: &Case,
    cut: &VirtualCut,
    accelerometer: Accelerometer,
    tachometer: TachometerModel,
    seed: u64,
) -> Outcome {
    let heard = cut
        .hear(case, accelerometer, tachometer, seed)
        .expect("the cut can be simulated");
    let monitor = Monitor::new(settings(case, accelerometer, tachometer)).expect("settings that can be");
    let mut state = State::default();
    let mut verdicts: Vec<(f64, Verdict, Option<f32>)> = Vec::new();
    for (block, edges) in &steps(heard) {
        let report = monitor.step(&mut state, block, edges, None, None);
        let judgement = report.judgement;
        if verdicts.last().is_none_or(|last| last.1 != judgement.verdict) {
            verdicts.push((
                report.time.0 as f64 * 1e-9,
                judgement.verdict,
                judgement.chatter.map(|chatter| chatter.0),
            ));
        }
    }
    Outcome {
        rpm: cut.spindle_rpm,
        depth_mm: cut.depth_mm,
        full_cut_s: cut.full_cut_s(case).expect("a cut that can be"),
        verdicts,
        growth: growth(case, cut),
    }
}

/// Displacement in each turn over that of the forced motion.
fn growth(case: &Case, cut: &VirtualCut) -> Vec<(f64, f64)> {
    let model = cut.model(case).expect("a model");
    let mut forced = cut.model(case).expect("a model");
    if let Some(cutting) = &mut forced.cutting {
        cutting.regeneration = Regeneration::None;
    }
    let [from, to] = cut.full_cut_s(case).expect("a cut that can be");
    let forced_m = sizes(&forced, cut)
        .into_iter()
        // In the second half of the full cut the entry has rung down.
        .filter(|(t, _)| (0.5 * (from + to)..to).contains(t))
        .fold(0.0_f64, |a, turn| a.max(turn.1));
    sizes(&model, cut)
        .into_iter()
        .map(|(t, size_m)| (t, size_m / forced_m))
        .collect()
}

/// Half the largest peak-to-peak displacement of any axis, turn by turn.
fn sizes(model: &Model, cut: &VirtualCut) -> Vec<(f64, f64)> {
    let turn_s = 60.0 / cut.spindle_rpm;
    let every_s = turn_s / 64.0;
    let mut room = Room::new(model);
    let mut taken = 0_usize;
    let mut turns: Vec<(f64, f64)> = Vec::new();
    let (mut low, mut high) = ([f64::MAX; 3], [f64::MIN; 3]);
    model
        .run(cut.seconds, Settings::default(), |segment| {
            while taken as f64 * every_s <= segment.to_s() {
                let t = taken as f64 * every_s;
                let x = segment.motion(t, &mut room).displacement_m;
                for axis in 0..3 {
                    low[axis] = low[axis].min(x[axis]);
                    high[axis] = high[axis].max(x[axis]);
                }
                taken += 1;
                if taken.is_multiple_of(64) {
                    let size = (0..3)
                        .map(|axis| 0.5 * (high[axis] - low[axis]))
                        .fold(0.0, f64::max);
                    turns.push((t, size));
                    (low, high) = ([f64::MAX; 3], [f64::MIN; 3]);
                }
            }
        })
        .expect("the cut can be simulated");
    turns
}
