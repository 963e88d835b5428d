//! Error rates of the chatter detector over many noise seeds: cuts below and above the stability limit, with runout, depth ramps and
//! random excitation of the structure.

use std::fmt;
use std::sync::Mutex;

use quietcut::case::Case;
use quietcut::simulate::{Accelerometer, Effects, Entry, TachometerModel, VirtualCut};
use quietcut_core::detector::Verdict;
use quietcut_core::tachometer::Wheel;

use crate::acceptance::{ABOVE, BELOW, LIMITS};
use crate::command;
use crate::shaking::Shaking;
use crate::virtual_cut::{Outcome, SimulatedCut};

/// One line of the table: cuts that differ only in random numbers, with their correct verdict.
#[derive(Clone, Debug)]
pub struct Line {
    /// Description of the cuts.
    pub name: String,
    /// Correct kind of chatter and its frequency in Hz; `None` for a stable cut.
    pub right: Option<(Verdict, f64)>,
    cut: VirtualCut,
    /// Number of teeth; the immersion ends at 180° and has the same ratio to the tooth pitch as in the case.
    teeth: u32,
    /// Spectral density of a random force on the structure, N/√Hz.
    shaking: f64,
    /// Noise of the sensor relative to its data sheet; the signal chain assumes the data sheet.
    noise: f64,
}

/// Results of the cuts of one line.
#[derive(Clone, Debug)]
pub struct Rates {
    line: Line,
    outcomes: Vec<Outcome>,
}

impl Line {
    fn new(name: &str, right: Option<(Verdict, f64)>, rpm: f64, depth_mm: f64) -> Self {
        Self {
            name: format!("{rpm} rev/min, {depth_mm:.2} mm{name}"),
            right,
            cut: long_cut(rpm, depth_mm),
            teeth: 2,
            shaking: 0.0,
            noise: 1.0,
        }
    }

    /// Two lines, below and above the stability limit, at the speed with this index in [`LIMITS`].
    pub fn pair(index: usize) -> [Self; 2] {
        let (rpm, limit_mm, kind, chatter_hz) = LIMITS[index];
        [
            Self::new("", None, rpm, BELOW * limit_mm),
            Self::new("", Some((kind, chatter_hz)), rpm, ABOVE * limit_mm),
        ]
    }

    /// Stable cut near a flip with runout: Floquet multiplier near −1 with |μ| from 0.97 to 0.99.
    pub fn runout(teeth: u32, offset_um: f64) -> Self {
        let (rpm, depth_mm) = match teeth {
            2 => (1050.0, 1.2),
            4 => (525.0, 1.1),
            _ => (350.0, 1.4),
        };
        let name = format!(", {teeth} teeth, runout {offset_um} µm");
        let mut line = Self::new(&name, None, rpm, depth_mm);
        line.teeth = teeth;
        line.cut.entry = Entry::Ramp { seconds: 0.3 };
        let runout = [format!("runout={offset_um}"), "runout.angle_deg=30".to_owned()];
        line.cut.effects = Effects::parse(runout.iter().map(String::as_str)).expect("an effect");
        line
    }

    /// Cut above the limit whose depth increases over this number of tooth passings.
    pub fn ramp(index: usize, passings: f64) -> Self {
        let [_, mut line] = Self::pair(index);
        let seconds = passings * 30.0 / line.cut.spindle_rpm;
        line.cut.entry = Entry::Ramp { seconds };
        line.name += &format!(", depth grows over {passings} teeth");
        line
    }

    /// Stable cut with a random force on the structure.
    pub fn shaken(index: usize, newton_per_root_hertz: f64) -> Self {
        let [mut line, _] = Self::pair(index);
        line.shaking = newton_per_root_hertz;
        line.name += &format!(", shaken by {newton_per_root_hertz} N/√Hz");
        line
    }

    /// Stable cut with a sensor whose noise exceeds the data sheet by the factor `noise`.
    pub fn noisy(index: usize, noise: f64) -> Self {
        let [mut line, _] = Self::pair(index);
        line.noise = noise;
        line.name += &format!(", sensor noise times {noise}");
        line
    }

    fn case(&self) -> Case {
        let path = command::cases().join("kuka-kr90-acetal.toml");
        let text = std::fs::read_to_string(&path).expect("a case");
        let start_deg = 180.0 - 180.0 / f64::from(self.teeth);
        let text = text
            .replace("teeth = 2", &format!("teeth = {}", self.teeth))
            .replace("start_deg = 90.0", &format!("start_deg = {start_deg:.1}"));
        Case::parse(&path, &text).expect("a case")
    }

    /// Sensors of cut `number`: range, clock error and tachometer vary.
    fn sensors(number: u64) -> (Accelerometer, TachometerModel) {
        let index = number as usize;
        let accelerometer = Accelerometer {
            range_g: [2.0, 16.0, 4.0, 8.0][index % 4],
            clock_error: [-0.03, 0.011, 0.0, 0.03][index % 4],
            ..Accelerometer::IIS3DWB_16G
        };
        let mut tachometer = TachometerModel::ONE_MARK;
        if index % 4 == 3 {
            tachometer.wheel = Wheel {
                positions: 60,
                missing: 2,
            };
        }
        (accelerometer, tachometer)
    }

    /// Runs the cuts of the line with this number of seeds.
    pub fn run(self, seeds: u64) -> Rates {
        let case = self.case();
        // A random force requires a new simulation for each seed; sensor noise alone does not.
        let cuts = if self.shaking > 0.0 { seeds } else { seeds.min(4) };
        let simulated: Vec<SimulatedCut> = (0..cuts)
            .map(|number| {
                let (mut accelerometer, tachometer) = Self::sensors(number);
                let assumed = accelerometer;
                accelerometer.noise_g_per_root_hertz *= self.noise;
                let shaking = (self.shaking > 0.0).then_some(Shaking {
                    newton_per_root_hertz: self.shaking,
                    seed: number,
                });
                SimulatedCut::new(&case, &self.cut, accelerometer, tachometer, shaking)
                    .with_assumed_accelerometer(&case, assumed)
            })
            .collect();
        let outcomes = (0..seeds).zip(simulated.iter().cycle());
        let outcomes = outcomes.map(|(seed, cut)| cut.outcome(seed)).collect();
        Rates { line: self, outcomes }
    }
}

/// Runs all lines in parallel on all processors; results keep the order of the lines.
pub fn run(lines: Vec<Line>, seeds: u64) -> Vec<Rates> {
    let count = lines.len();
    let queue = Mutex::new(lines.into_iter().enumerate());
    let done = Mutex::new(Vec::with_capacity(count));
    let next = || queue.lock().expect("no worker panics here").next();
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(|| {
                while let Some((number, line)) = next() {
                    let rates = line.run(seeds);
                    done.lock().expect("no worker panics here").push((number, rates));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no worker panicked");
    done.sort_by_key(|(number, _)| *number);
    done.into_iter().map(|(_, rates)| rates).collect()
}

impl Rates {
    fn alarms(&self) -> impl Iterator<Item = (f64, Verdict, f64)> {
        self.outcomes.iter().filter_map(|outcome| {
            let (t, verdict, hz) = outcome.first_alarm()?;
            Some((outcome.ratio_at(t), verdict, hz))
        })
    }

    /// Number of cuts with a wrong alarm; for a stable cut any alarm is wrong.
    pub fn wrong(&self) -> usize {
        let right = self.line.right.map(|(kind, _)| kind);
        self.alarms().filter(|(_, kind, _)| Some(*kind) != right).count()
    }

    /// Number of cuts with the correct alarm before the vibration exceeded the forced vibration by the factor `ratio`; if loss of
    /// contact limits the vibration to less, before the end of the cut.
    pub fn in_time(&self, ratio: f64) -> usize {
        let right = self.line.right.map(|(kind, _)| kind);
        let is_in_time = |outcome: &&Outcome| {
            let deadline_s = outcome.grown_to(ratio).unwrap_or(outcome.full_cut_s[1]);
            outcome
                .first_alarm()
                .is_some_and(|(t, kind, _)| Some(kind) == right && t <= deadline_s)
        };
        self.outcomes.iter().filter(is_in_time).count()
    }

    /// Largest error of the chatter frequency in the first alarm, Hz.
    pub fn frequency_error_hz(&self) -> f64 {
        let right = self.line.right.map_or(0.0, |(_, hz)| hz);
        self.alarms()
            .fold(0.0, |worst, (.., hz)| worst.max((hz - right).abs()))
    }

    /// Whether the cuts chatter.
    pub fn has_chatter(&self) -> bool {
        self.line.right.is_some()
    }

    /// Number of cuts.
    pub fn cuts(&self) -> usize {
        self.outcomes.len()
    }
}

impl Rates {
    /// Description of the cuts.
    pub fn name(&self) -> &str {
        &self.line.name
    }

    /// Rates as text: false alarms of stable cuts; timely and correct verdicts of cuts with chatter.
    pub fn findings(&self) -> String {
        let cuts = self.cuts();
        if self.line.right.is_none() {
            return format!("false alarms {}/{cuts}", self.wrong());
        }
        let mut ratios: Vec<f64> = self.alarms().map(|alarm| alarm.0).collect();
        ratios.sort_by(f64::total_cmp);
        let median = ratios.get(ratios.len() / 2).copied().unwrap_or(f64::NAN);
        let worst = ratios.last().copied().unwrap_or(f64::NAN);
        format!(
            "in time {}/{cuts}, wrong kind {}; ratio {median:.2}, worst {worst:.2}; frequency within {:.2} Hz",
            self.in_time(5.0),
            self.wrong(),
            self.frequency_error_hz()
        )
    }
}

impl fmt::Display for Rates {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{:<58}{}", self.name(), self.findings())
    }
}

/// Cut with entry and exit through the side faces and 12 s of full engagement, at least 240 tooth passings.
fn long_cut(rpm: f64, depth_mm: f64) -> VirtualCut {
    let mut cut = VirtualCut::new(rpm, depth_mm, 20.0);
    // Time from first contact to half immersion: tool radius divided by feed speed.
    let way_s = 6.35 / (0.15 * 2.0 * rpm / 60.0);
    cut.seconds = 2.0 * way_s + 12.0 + 2.0 * cut.air_s;
    cut
}
