//! Puzzles: a case and recordings for the diagnosis, and the effects hidden in them.

use std::path::Path;

use quietcut::case::Case;
use quietcut::recording::{Channel, Quantity, Recording, Sidecar};
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, EffectKind, NOT_IN_LIBRARY, Scale};
use super::cut::CutBench;
use super::machine::{Machine, between};
use super::oracle::{Lab, Oracle, Output, Verdict};
use super::rig::{Bench as RigBench, Rig, Test};
use super::sensor::letter;

/// Families of puzzles in the campaign.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    Shaker,
    Sweep,
    FreeDecay,
    CuttingWithForce,
    CuttingWithoutForce,
    Nothing,
    NotInLibrary,
    TwoEffects,
    /// Tests of structures with quadratic damping.
    QuadraticDamping,
    /// Tests of structures with a quintic spring.
    QuinticStiffness,
    /// Tests of structures with the microslip of a joint.
    JointFriction,
    /// Cuts in chatter. The oracle does not treat them: in a growing motion every trajectory contains more information on the machine than
    /// a fit can extract. Of rates, only that of answers with high confidence is required.
    Chatter,
    /// Cuts in a workshop: a baseline that is known from tests only, in disturbed cuts.
    CuttingInWorkshop,
    /// The same with nothing hidden.
    NothingInWorkshop,
}

impl Family {
    pub(crate) const ALL: [Self; 14] = [
        Self::Shaker,
        Self::Sweep,
        Self::FreeDecay,
        Self::CuttingWithForce,
        Self::CuttingWithoutForce,
        Self::Nothing,
        Self::NotInLibrary,
        Self::TwoEffects,
        Self::QuadraticDamping,
        Self::QuinticStiffness,
        Self::JointFriction,
        Self::Chatter,
        Self::CuttingInWorkshop,
        Self::NothingInWorkshop,
    ];

    /// Name of the family, as in `QUIETCUT_FAMILY`.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Shaker => "shaker",
            Self::Sweep => "sweep",
            Self::FreeDecay => "free-decay",
            Self::CuttingWithForce => "cutting-with-force",
            Self::CuttingWithoutForce => "cutting-without-force",
            Self::Nothing => "nothing-hidden",
            Self::NotInLibrary => "not-in-library",
            Self::TwoEffects => "two-effects",
            Self::QuadraticDamping => "quadratic-damping",
            Self::QuinticStiffness => "quintic-stiffness",
            Self::JointFriction => "joint-friction",
            Self::Chatter => "chatter",
            Self::CuttingInWorkshop => "workshop-cutting",
            Self::NothingInWorkshop => "workshop-nothing",
        }
    }
}

/// A hidden effect with its true parameters by the keys of answers.
#[derive(Clone, Debug)]
pub(crate) struct Hidden {
    pub(crate) name: &'static str,
    pub(crate) values: Vec<(&'static str, f64)>,
    /// Direction or channels of the effect; empty if it acts everywhere.
    pub(crate) places: Vec<String>,
    /// d² of the effect in cuts of a workshop; 0 elsewhere.
    pub(crate) distance: f64,
}

/// Significant digits of the samples that [`Puzzle::keep_short`] writes: their rounding is 15 times below the least noise.
const DIGITS: usize = 5;

/// One puzzle: that of a seed of a family.
pub(crate) struct Puzzle {
    pub(crate) family: Family,
    pub(crate) seed: u64,
    pub(crate) case: Case,
    pub(crate) case_text: String,
    pub(crate) recordings: Vec<Recording>,
    pub(crate) hidden: Vec<Hidden>,
    /// By effect: root mean square of the change that it makes in addition to the other effects, over the noise, in the channel where that
    /// is largest.
    pub(crate) ratios: Vec<f64>,
    pub(crate) verdict: Verdict,
    /// Number of draws that were rejected before this one as borderline.
    pub(crate) redrawn: usize,
}

/// Range of the sensor noise, as a share of the signal: from a good sensor to a bad one.
const NOISE: [f64; 2] = [3e-4, 0.05];

/// Largest sensor noise of puzzles in chatter, as a share of the signal.
const NOISE_IN_CHATTER: f64 = 0.01;

impl Puzzle {
    /// Draws the puzzle of a seed: the first draw that is not borderline.
    pub(crate) fn draw(family: Family, seed: u64) -> Self {
        let mut redrawn = 0;
        loop {
            let mut random = ChaCha8Rng::seed_from_u64(seed * 1000 + redrawn as u64);
            if let Some(mut puzzle) = Self::try_draw(family, seed, &mut random) {
                puzzle.redrawn = redrawn;
                return puzzle;
            }
            redrawn += 1;
        }
    }

    /// Writes case, recordings and hidden effects to a folder, for `quietcut diagnose`.
    pub(crate) fn keep(&self, folder: &Path) {
        let name = format!("{}-{}.toml", self.family.name(), self.seed);
        std::fs::write(folder.join(&name), &self.case_text).unwrap();
        let hidden = format!("{:?}\n{:?}\n", self.hidden, self.verdict);
        std::fs::write(folder.join(name.replace(".toml", ".hidden")), hidden).unwrap();
        for recording in &self.recordings {
            recording.write(&folder.join(&recording.path)).unwrap();
        }
    }

    /// Number of samples of all channels of all recordings.
    pub(crate) fn samples(&self) -> usize {
        let channels = self.recordings.iter().flat_map(|recording| &recording.channels);
        channels.map(|channel| channel.samples.len()).sum()
    }

    /// Writes case and recordings to a folder in few bytes: samples with [`DIGITS`] digits, and the sample rate in the sidecar instead of
    /// a column of times. The head of the case names the hidden effects.
    pub(crate) fn keep_short(&self, folder: &Path) {
        let name = format!("{}-{}.toml", self.family.name(), self.seed);
        let hidden = self
            .hidden
            .iter()
            .map(|hidden| {
                format!(
                    "# hidden: {} {:?} {:?}\n",
                    hidden.name, hidden.places, hidden.values
                )
            })
            .collect::<String>();
        std::fs::write(folder.join(name), hidden + &self.case_text).unwrap();
        for recording in &self.recordings {
            let title = |channel: &Channel| match channel.quantity {
                Quantity::Unknown => channel.name.clone(),
                quantity => format!("{} [{}]", channel.name, quantity.unit()),
            };
            let mut text = recording.channels.iter().map(title).collect::<Vec<_>>().join(",");
            text.push('\n');
            for sample in 0..recording.len() {
                let number = |channel: &Channel| {
                    let rounded: f64 = format!("{:.*e}", DIGITS - 1, channel.samples[sample])
                        .parse()
                        .unwrap();
                    let (plain, exponent) = (rounded.to_string(), format!("{rounded:e}"));
                    if exponent.len() < plain.len() {
                        exponent
                    } else {
                        plain
                    }
                };
                text.push_str(
                    &recording
                        .channels
                        .iter()
                        .map(number)
                        .collect::<Vec<_>>()
                        .join(","),
                );
                text.push('\n');
            }
            let path = folder.join(&recording.path);
            std::fs::write(&path, text).unwrap();
            let sidecar = Sidecar {
                sample_rate_hz: Some(recording.sample_rate_hz),
                ..recording.sidecar.clone()
            };
            sidecar.write_beside(&path).unwrap();
        }
    }

    fn try_draw(family: Family, seed: u64, random: &mut ChaCha8Rng) -> Option<Self> {
        let cutting = match family {
            Family::CuttingWithForce => Some(true),
            Family::CuttingWithoutForce => Some(false),
            Family::Chatter => Some(random.random()),
            Family::Nothing | Family::TwoEffects if random.random::<f64>() < 0.4 => Some(random.random()),
            _ => None,
        };
        let bench = match cutting {
            Some(forces) if family == Family::Chatter => {
                Bench::Cut(Box::new(CutBench::draw(random, forces).chattering()?))
            }
            Some(forces) => Bench::Cut(Box::new(CutBench::draw(random, forces))),
            None => {
                let test = match family {
                    Family::Shaker => Test::Shaker,
                    Family::Sweep => Test::Sweep,
                    Family::FreeDecay => Test::FreeDecay,
                    _ => *[Test::Shaker, Test::Sweep, Test::FreeDecay].choose(random)?,
                };
                // Two directions cost the oracle several times as much; a third of the machines have them.
                let directions = if random.random::<f64>() < 0.35 { 2 } else { 1 };
                let machine = Machine::draw(random, directions);
                let rig = Rig::draw(random, test, &machine);
                Bench::Rig(Box::new(RigBench { machine, rig }))
            }
        };
        let lab = bench.lab();
        let hidden = hide(family, lab, random)?;
        let sigma = noise(family, &bench, &hidden, random)?;
        let oracle = Oracle::new(lab, &sigma);
        let verdict = match &hidden[..] {
            [] => Verdict::Invisible,
            _ if family == Family::Chatter => Verdict::Separable,
            [one] if NOT_IN_LIBRARY.contains(&one.kind) => {
                // An effect that is not in the library must leave at least a quarter of the noise energy unexplained.
                let samples = oracle.of(&[]).len();
                if oracle.unexplained(&hidden, random) < 0.25 * samples as f64 {
                    Verdict::Borderline
                } else {
                    Verdict::Separable
                }
            }
            [one] => oracle.verdict(one, random),
            [first, second, ..] => oracle.verdict_of_two(&[first.clone(), second.clone()], random),
        };
        if verdict == Verdict::Borderline {
            return None;
        }
        let output = lab.output(&hidden);
        if !output.iter().flatten().flatten().all(|value| value.is_finite()) {
            // With these effects the machine is unstable.
            return None;
        }
        let beside = |gone: usize| {
            let mut others = hidden.clone();
            others.remove(gone);
            largest_ratio(&output, &lab.output(&others), &oracle.noise())
        };
        let ratios = (0..hidden.len()).map(beside).collect();
        let name = format!("{}-{seed}", family.name());
        let (machine, scale) = bench.machine();
        let describe = |cause: &Cause| Hidden {
            name: cause.kind.name(),
            values: cause.values(machine, scale),
            places: bench.places_of(cause),
            distance: 0.0,
        };
        let case_text = bench.case_text();
        Some(Self {
            family,
            seed,
            case: Case::parse("baseline.toml".as_ref(), &case_text).unwrap(),
            case_text,
            recordings: match &bench {
                Bench::Rig(bench) => bench.rig.recordings(&output, &sigma, random, &name),
                Bench::Cut(bench) => bench.recordings(&output, &sigma, random, &name),
            },
            hidden: hidden.iter().map(describe).collect(),
            ratios,
            verdict,
            redrawn: 0,
        })
    }
}

/// The virtual test or cut in which the effects of a puzzle are hidden.
enum Bench {
    Rig(Box<RigBench>),
    Cut(Box<CutBench>),
}

impl Bench {
    fn lab(&self) -> &dyn Lab {
        match self {
            Self::Rig(bench) => &**bench,
            Self::Cut(bench) => &**bench,
        }
    }

    fn machine(&self) -> (&Machine, &Scale) {
        match self {
            Self::Rig(bench) => (&bench.machine, &bench.rig.scale),
            Self::Cut(bench) => (&bench.machine, &bench.scale),
        }
    }

    /// Direction or channels of a cause, as answers name them; empty if it acts everywhere.
    fn places_of(&self, cause: &Cause) -> Vec<String> {
        if !cause.kind.of_sensor() {
            let direction = cause.kind.has_direction().then(|| letter(cause.axis).to_string());
            return direction.into_iter().collect();
        }
        match self {
            Self::Rig(bench) => vec![bench.rig.sensors[cause.sensor].name()],
            Self::Cut(bench) => bench.channels_of(cause.sensor),
        }
    }

    fn case_text(&self) -> String {
        match self {
            Self::Rig(bench) => bench.machine.case_text(),
            Self::Cut(bench) => bench.case_text(),
        }
    }

    /// Standard deviation of the spindle angle, which is the last channel of a cut; `None` for a test of the structure.
    fn angle_sigma(&self) -> Option<f64> {
        match self {
            Self::Rig(_) => None,
            Self::Cut(bench) => Some(bench.angle_sigma()),
        }
    }
}

/// A hidden effect in cuts, as the judge reads it.
pub(crate) fn describe(cause: &Cause, bench: &CutBench) -> Hidden {
    let places = if cause.kind.of_sensor() {
        bench.channels_of(cause.sensor)
    } else {
        let direction = cause.kind.has_direction().then(|| letter(cause.axis).to_string());
        direction.into_iter().collect()
    };
    Hidden {
        name: cause.kind.name(),
        values: cause.values(&bench.machine, &bench.scale),
        places,
        distance: 0.0,
    }
}

/// Draws the effects that are hidden in a puzzle of this family; `None` if the draw is impossible.
fn hide(family: Family, bench: &dyn Lab, random: &mut ChaCha8Rng) -> Option<Vec<Cause>> {
    let (kinds, count) = match family {
        Family::Nothing => return Some(Vec::new()),
        Family::NotInLibrary => (NOT_IN_LIBRARY.to_vec(), 1),
        Family::QuadraticDamping => (vec![EffectKind::QuadraticDamping], 1),
        Family::QuinticStiffness => (vec![EffectKind::QuinticStiffness], 1),
        Family::JointFriction => (vec![EffectKind::JointFriction], 1),
        Family::TwoEffects => (bench.drawn(), 2),
        Family::Chatter if random.random::<f64>() < 0.2 => return Some(Vec::new()),
        _ => (bench.drawn(), 1),
    };
    let mut hidden: Vec<Cause> = Vec::new();
    while hidden.len() < count {
        let kind = *kinds.choose(random)?;
        // An effect that this machine cannot have makes the draw fail, so that all effects stay equally frequent.
        let (axis, sensor) = *bench.places(kind).choose(random)?;
        if hidden.iter().any(|other| other.kind == kind) {
            return None;
        }
        hidden.push(Cause {
            kind,
            axis,
            sensor,
            shares: kind.draw(random),
        });
    }
    Some(hidden)
}

/// Standard deviation of every sensor, such that the effect is between a third of the noise and sixty times the noise, within the range of
/// real sensors.
fn noise(family: Family, bench: &Bench, hidden: &[Cause], random: &mut ChaCha8Rng) -> Option<Vec<f64>> {
    let plain = bench.lab().output(&[]);
    let angle = bench.angle_sigma();
    let sensors = plain[0].len() - usize::from(angle.is_some());
    let size: Vec<f64> = (0..sensors)
        .map(|sensor| rms(plain.iter().map(|run| &run[sensor][..])))
        .collect();
    let share = if family == Family::Chatter {
        between(random, NOISE[0], NOISE_IN_CHATTER)
    } else if hidden.is_empty() {
        between(random, NOISE[0], NOISE[1])
    } else {
        let changed = bench.lab().output(hidden);
        let relative = largest_ratio(&changed, &plain, &size);
        let least = if matches!(family, Family::NotInLibrary | Family::TwoEffects) {
            3.0
        } else {
            0.3
        };
        (relative / between(random, least, 60.0)).clamp(NOISE[0], NOISE[1])
    };
    // The motion must be bounded, and every direction must move.
    let moves = size.iter().all(|size| size.is_finite() && *size > 0.0);
    moves.then(|| size.iter().map(|size| size * share).chain(angle).collect())
}

pub(crate) fn rms<'a>(runs: impl Iterator<Item = &'a [f64]>) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for value in runs.flatten() {
        sum += value * value;
        count += 1;
    }
    (sum / f64::from(count)).sqrt()
}

fn largest_ratio(changed: &Output, plain: &Output, unit: &[f64]) -> f64 {
    let of = |sensor: usize| {
        let differences: Vec<Vec<f64>> = changed
            .iter()
            .zip(plain)
            .map(|(a, b)| a[sensor].iter().zip(&b[sensor]).map(|(a, b)| a - b).collect())
            .collect();
        rms(differences.iter().map(|run| &run[..])) / unit[sensor]
    };
    (0..unit.len()).map(of).fold(0.0, f64::max)
}
