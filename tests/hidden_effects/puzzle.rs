//! What is handed to the tool: a case, recordings; and beside it what is hidden.

use std::path::Path;

use quietcut::case::Case;
use quietcut::recording::Recording;
use rand::seq::IndexedRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::cause::{Cause, STRANGE, Scale};
use super::cut::{CutBench, EVERY_FORCE, EVERY_SENSOR};
use super::judge::{Judge, Lab, Verdict};
use super::machine::{Machine, between};
use super::rig::{Bench as RigBench, Output, Rig, Test};
use super::sensor::letter;

/// The families of the campaign.
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
    /// Cuts in chatter. What their records could tell at best is not known: every trajectory of a motion that grows tells more of the
    /// machine than can be had from it, so that there is no judge, and no rate is asked for but of what is said with confidence.
    Chatter,
}

impl Family {
    pub(crate) const ALL: [Self; 9] = [
        Self::Shaker,
        Self::Sweep,
        Self::FreeDecay,
        Self::CuttingWithForce,
        Self::CuttingWithoutForce,
        Self::Nothing,
        Self::NotInLibrary,
        Self::TwoEffects,
        Self::Chatter,
    ];

    /// Its name, by which it is asked for.
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
            Self::Chatter => "chatter",
        }
    }
}

/// An effect with its parameters by the keys of answers.
#[derive(Clone, Debug)]
pub(crate) struct Hidden {
    pub(crate) name: &'static str,
    pub(crate) values: Vec<(&'static str, f64)>,
    /// Its direction or channels, where it has such.
    pub(crate) places: Vec<String>,
}

/// One seed of a family.
pub(crate) struct Puzzle {
    pub(crate) family: Family,
    pub(crate) seed: u64,
    pub(crate) case: Case,
    case_text: String,
    pub(crate) recordings: Vec<Recording>,
    pub(crate) hidden: Vec<Hidden>,
    /// Root mean square of the change that each effect makes beside the other, over the noise, in the channel where it is largest.
    pub(crate) ratios: Vec<f64>,
    pub(crate) verdict: Verdict,
    /// How many draws before this one were between all verdicts.
    pub(crate) redrawn: usize,
}

/// Noise, as a share of the signal: from that of a good sensor to that of a bad one.
const NOISE: [f64; 2] = [3e-4, 0.05];

/// The most in chatter.
const NOISE_IN_CHATTER: f64 = 0.01;

impl Puzzle {
    /// The puzzle of a seed: the first draw that is not between the verdicts.
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

    /// Writes case, recordings and what is hidden in them to a folder, for `quietcut diagnose`.
    pub(crate) fn keep(&self, folder: &Path) {
        let name = format!("{}-{}.toml", self.family.name(), self.seed);
        std::fs::write(folder.join(&name), &self.case_text).unwrap();
        let hidden = format!("{:?}\n{:?}\n", self.hidden, self.verdict);
        std::fs::write(folder.join(name.replace(".toml", ".hidden")), hidden).unwrap();
        for recording in &self.recordings {
            recording.write(&folder.join(&recording.path)).unwrap();
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
                Bench::Cut(CutBench::draw(random, forces).chattering()?)
            }
            Some(forces) => Bench::Cut(CutBench::draw(random, forces)),
            None => {
                let test = match family {
                    Family::Shaker => Test::Shaker,
                    Family::Sweep => Test::Sweep,
                    Family::FreeDecay => Test::FreeDecay,
                    _ => *[Test::Shaker, Test::Sweep, Test::FreeDecay].choose(random)?,
                };
                // Two directions cost the judge several times as much; a third of the machines have them.
                let directions = if random.random::<f64>() < 0.35 { 2 } else { 1 };
                let machine = Machine::draw(random, directions);
                let rig = Rig::draw(random, test, &machine);
                Bench::Rig(RigBench { machine, rig })
            }
        };
        let lab = bench.lab();
        let hidden = hide(family, lab, random)?;
        let sigma = noise(family, &bench, &hidden, random)?;
        let judge = Judge::new(lab, &sigma);
        let verdict = match &hidden[..] {
            [] => Verdict::Invisible,
            _ if family == Family::Chatter => Verdict::Separable,
            [one] if STRANGE.contains(&one.kind) => {
                // As plain as half the noise, in the mean over all samples.
                let samples = judge.of(&[]).len();
                if judge.unexplained(&hidden, random) < 0.25 * samples as f64 {
                    Verdict::Borderline
                } else {
                    Verdict::Separable
                }
            }
            [one] => judge.verdict(one, random),
            [first, second, ..] => judge.verdict_of_two(&[first.clone(), second.clone()], random),
        };
        if verdict == Verdict::Borderline {
            return None;
        }
        let output = lab.output(&hidden);
        if !output.iter().flatten().flatten().all(|value| value.is_finite()) {
            // A machine that runs away under what is hidden.
            return None;
        }
        let beside = |gone: usize| {
            let mut others = hidden.clone();
            others.remove(gone);
            largest_ratio(&output, &lab.output(&others), &judge.noise())
        };
        let ratios = (0..hidden.len()).map(beside).collect();
        let name = format!("{}-{seed}", family.name());
        let (machine, scale) = bench.machine();
        let describe = |cause: &Cause| Hidden {
            name: cause.kind.name(),
            values: cause.values(machine, scale),
            places: bench.places_of(cause),
        };
        let case_text = bench.case_text();
        Some(Self {
            family,
            seed,
            case: Case::parse("believed.toml".as_ref(), &case_text).unwrap(),
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

/// Where the effects of a puzzle are hidden.
enum Bench {
    Rig(RigBench),
    Cut(CutBench),
}

impl Bench {
    fn lab(&self) -> &dyn Lab {
        match self {
            Self::Rig(bench) => bench,
            Self::Cut(bench) => bench,
        }
    }

    fn machine(&self) -> (&Machine, &Scale) {
        match self {
            Self::Rig(bench) => (&bench.machine, &bench.rig.scale),
            Self::Cut(bench) => (&bench.machine, &bench.scale),
        }
    }

    /// The direction or the channels of a cause, as answers call them; none where it is everywhere.
    fn places_of(&self, cause: &Cause) -> Vec<String> {
        if !cause.kind.of_sensor() {
            let direction = cause.kind.has_direction().then(|| letter(cause.axis).to_string());
            return direction.into_iter().collect();
        }
        match self {
            Self::Rig(bench) => vec![bench.rig.sensors[cause.sensor].name()],
            Self::Cut(bench) if cause.sensor == EVERY_FORCE => bench.force_names(),
            // All of one are that one.
            Self::Cut(bench) if cause.sensor == EVERY_SENSOR => match &bench.motion_names()[..] {
                [one] => vec![one.clone()],
                _ => Vec::new(),
            },
            Self::Cut(bench) => bench
                .channel_names()
                .get(cause.sensor)
                .cloned()
                .into_iter()
                .collect(),
        }
    }

    fn case_text(&self) -> String {
        match self {
            Self::Rig(bench) => bench.machine.case_text(),
            Self::Cut(bench) => bench.case_text(),
        }
    }

    /// Noise of what is not a sensor but known from one: the angle that the tachometer tells, the last channel of a cut.
    fn angle_sigma(&self) -> Option<f64> {
        match self {
            Self::Rig(_) => None,
            Self::Cut(bench) => Some(bench.angle_sigma()),
        }
    }
}

/// What is hidden in a puzzle of this family.
fn hide(family: Family, bench: &dyn Lab, random: &mut ChaCha8Rng) -> Option<Vec<Cause>> {
    let (kinds, count) = match family {
        Family::Nothing => return Some(Vec::new()),
        Family::NotInLibrary => (STRANGE.to_vec(), 1),
        Family::TwoEffects => (bench.kinds(), 2),
        Family::Chatter if random.random::<f64>() < 0.2 => return Some(Vec::new()),
        _ => (bench.kinds(), 1),
    };
    let mut hidden: Vec<Cause> = Vec::new();
    while hidden.len() < count {
        let kind = *kinds.choose(random)?;
        // A kind that this machine cannot have makes another draw, so that kinds stay evenly mixed.
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

/// σ of every sensor, such that the effect is from a third of the noise to sixty times as large, if a sensor can be so good.
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
    // A motion that ran away, or a direction that does not move.
    let moves = size.iter().all(|size| size.is_finite() && *size > 0.0);
    moves.then(|| size.iter().map(|size| size * share).chain(angle).collect())
}

fn rms<'a>(runs: impl Iterator<Item = &'a [f64]>) -> f64 {
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
