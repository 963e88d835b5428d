//! Virtual cuts through the signal chain: its verdicts, and the size of the vibration at each verdict.

use std::fmt;

use quietcut::case::Case;
use quietcut::simulate::{
    Accelerometer, DenseStep, Model, Regeneration, Sampler, SensedCut, Settings, Spindle, Statistics,
    TachometerModel, VirtualCut, Workspace,
};
use quietcut_core::detector::Verdict;
use quietcut_core::monitor::{self, Monitor, State};

use crate::acceptance::{AcceptanceCut, settings};
use crate::outputs::steps;
use crate::shaking::Shaking;

/// Result of a virtual cut.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Spindle speed, rev/min.
    pub rpm: f64,
    /// Axial depth, mm.
    pub depth_mm: f64,
    /// Start and end of full engagement, s.
    pub full_cut_s: [f64; 2],
    /// Every verdict that differs from the preceding one: time in s, verdict, chatter frequency in Hz.
    pub verdicts: Vec<(f64, Verdict, Option<f32>)>,
    /// Largest displacement in each revolution, divided by that of the forced vibration at full engagement: end of the
    /// revolution in s, ratio.
    pub growth: Vec<(f64, f64)>,
}

impl Outcome {
    /// The first chatter verdict: time in s, verdict, and stated frequency in Hz.
    pub fn first_alarm(&self) -> Option<(f64, Verdict, f64)> {
        let alarm = self.verdicts.iter().find(|(_, verdict, _)| verdict.is_chatter());
        alarm.map(|(t, verdict, hz)| (*t, *verdict, hz.map_or(f64::NAN, f64::from)))
    }

    /// Time in s at which the ratio of the vibration to the forced vibration first reaches `ratio`.
    pub fn grown_to(&self, ratio: f64) -> Option<f64> {
        self.growth.iter().find(|turn| turn.1 > ratio).map(|turn| turn.0)
    }

    /// Ratio of the vibration to the forced vibration at time `t`.
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
            Some((t, verdict, _)) => write!(f, "{verdict:?} at {t:.2} s, ratio {:.2}", self.ratio_at(t))?,
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

/// A cut that is simulated once and measured with many seeds of the sensor noise.
pub struct SimulatedCut {
    settings: monitor::Settings,
    cut: VirtualCut,
    full_cut_s: [f64; 2],
    growth: Vec<(f64, f64)>,
    tachometer: TachometerModel,
    sampler: Sampler,
    statistics: Statistics,
}

impl SimulatedCut {
    /// Simulates one of the acceptance cuts.
    pub fn of(acceptance: &AcceptanceCut) -> Self {
        let AcceptanceCut {
            case,
            cut,
            accelerometer,
            tachometer,
            ..
        } = acceptance;
        Self::new(case, cut, *accelerometer, *tachometer, None)
    }

    /// Simulates a cut of `case` with these sensors. A further force may excite the structure.
    pub fn new(
        case: &Case,
        cut: &VirtualCut,
        accelerometer: Accelerometer,
        tachometer: TachometerModel,
        shaking: Option<Shaking>,
    ) -> Self {
        let mut model = cut.model(case).expect("a model");
        let full_cut_s = cut.full_cut_s(case).expect("a cut that can be");
        let forced_m = forced_m(case, cut, full_cut_s);
        model.drive = shaking.map(|shaking| shaking.for_seconds(cut.seconds + 1.0));
        let mut sampler = Sampler::new(&model, accelerometer);
        let mut sizes = Sizes::new(&model, cut.spindle_rpm);
        let end_s = cut.seconds + sampler.tail_s();
        let statistics = model
            .run(end_s, Settings::default(), |segment| {
                sampler.observe(segment);
                sizes.observe(segment);
            })
            .expect("the cut can be simulated");
        let growth = sizes.turns.into_iter().map(|(t, size_m)| (t, size_m / forced_m));
        Self {
            settings: settings(case, accelerometer, tachometer),
            cut: cut.clone(),
            full_cut_s,
            growth: growth.collect(),
            tachometer,
            sampler,
            statistics,
        }
    }

    /// Configures the signal chain for another accelerometer than the simulated one.
    pub fn with_assumed_accelerometer(mut self, case: &Case, accelerometer: Accelerometer) -> Self {
        self.settings = settings(case, accelerometer, self.tachometer);
        self
    }

    /// Runs the signal chain over the cut. `seed` is the seed of the sensor noise.
    pub fn outcome(&self, seed: u64) -> Outcome {
        let Self { cut, tachometer, .. } = self;
        let sensed = SensedCut {
            blocks: self.sampler.blocks(seed),
            edges: tachometer.edges(&Spindle::new(cut.spindle_rpm), cut.seconds, seed),
            statistics: self.statistics,
        };
        let monitor = Monitor::new(self.settings).expect("settings that can be");
        let mut state = State::default();
        let mut verdicts: Vec<(f64, Verdict, Option<f32>)> = Vec::new();
        for (block, edges) in &steps(sensed) {
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
            full_cut_s: self.full_cut_s,
            verdicts,
            growth: self.growth.clone(),
        }
    }
}

/// Amplitude of the forced vibration at full engagement, m.
fn forced_m(case: &Case, cut: &VirtualCut, [from, to]: [f64; 2]) -> f64 {
    let mut forced = cut.model(case).expect("a model");
    if let Some(cutting) = &mut forced.cutting {
        cutting.regeneration = Regeneration::None;
    }
    let mut sizes = Sizes::new(&forced, cut.spindle_rpm);
    forced
        .run(to, Settings::default(), |segment| sizes.observe(segment))
        .expect("the cut can be simulated");
    let settled = sizes
        .turns
        .iter()
        // In the second half of full engagement the transient of the entry has decayed.
        .filter(|(t, _)| (0.5 * (from + to)..to).contains(t));
    settled.fold(0.0, |largest, turn| largest.max(turn.1))
}

/// Half the largest peak-to-peak displacement of any axis, for each revolution.
struct Sizes {
    every_s: f64,
    workspace: Workspace,
    taken: usize,
    low: [f64; 3],
    high: [f64; 3],
    /// End of each revolution in s, size in m.
    turns: Vec<(f64, f64)>,
}

impl Sizes {
    /// Number of displacement samples per revolution.
    const PER_TURN: usize = 64;

    fn new(model: &Model, rpm: f64) -> Self {
        Self {
            every_s: 60.0 / rpm / Self::PER_TURN as f64,
            workspace: Workspace::new(model),
            taken: 0,
            low: [f64::MAX; 3],
            high: [f64::MIN; 3],
            turns: Vec::new(),
        }
    }

    fn observe(&mut self, segment: &DenseStep<'_>) {
        while self.taken as f64 * self.every_s <= segment.to_s() {
            let t = self.taken as f64 * self.every_s;
            let x = segment.motion(t, &mut self.workspace).displacement_m;
            for ((low, high), x) in self.low.iter_mut().zip(&mut self.high).zip(x) {
                *low = low.min(x);
                *high = high.max(x);
            }
            self.taken += 1;
            if self.taken.is_multiple_of(Self::PER_TURN) {
                let ranges = self.low.iter().zip(&self.high).map(|(low, high)| high - low);
                self.turns.push((t, 0.5 * ranges.fold(0.0, f64::max)));
                (self.low, self.high) = ([f64::MAX; 3], [f64::MIN; 3]);
            }
        }
    }
}
