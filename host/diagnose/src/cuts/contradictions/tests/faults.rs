//! Faults of cases and records.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use quietcut_model::case::Case;
use quietcut_recording::{Quantity, Recording};

/// One fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Fault {
    Teeth(usize),
    /// Exit and entry changed by angles, degrees.
    Engagement(f64, f64),
    UpForDown,
    /// The spindle turns the other way.
    Rotation,
    Swapped(Quantity),
    Inverted(Quantity, usize),
    AllInverted(Quantity),
    Scaled(Quantity, usize, f64),
    AllScaled(Quantity, f64),
    Air,
    Clipped(Quantity, f64),
    MissedPulses(usize),
    DoubledPulses(usize),
    Clock(f64),
    NotANumber(usize),
    TwoTools,
}

const PREFIX: [&str; 3] = ["x", "y", "z"];

fn name(quantity: Quantity, axis: usize) -> String {
    let letter = match quantity {
        Quantity::Force => "f",
        Quantity::Acceleration => "a",
        _ => "",
    };
    format!("{letter}{}", PREFIX[axis])
}

fn samples<'a>(record: &'a mut Recording, name: &str) -> Option<&'a mut Vec<f64>> {
    record
        .channels
        .iter_mut()
        .find(|channel| channel.name == name)
        .map(|channel| &mut channel.samples)
}

fn scale(record: &mut Recording, name: &str, factor: f64) -> bool {
    samples(record, name)
        .map(|samples| samples.iter_mut().for_each(|sample| *sample *= factor))
        .is_some()
}

fn of_quantity(record: &Recording, quantity: Quantity) -> Vec<String> {
    (0..3)
        .map(|axis| name(quantity, axis))
        .filter(|name| record.channel(name).is_some())
        .collect()
}

/// Sample positions of the rising edges.
fn edges(level: &[f64]) -> Vec<usize> {
    let middle = 0.5 * level.iter().fold(0.0_f64, |most, value| most.max(*value));
    (1..level.len())
        .filter(|at| level[at - 1] < middle && level[*at] >= middle)
        .collect()
}

impl Fault {
    /// Words of the message that says this fault, for a tool with `teeth` teeth and the channels of `records`.
    pub(super) fn words(self, teeth: usize, records: &[Recording]) -> String {
        let all = |quantity| of_quantity(&records[0], quantity).join(", ");
        match self {
            Self::Teeth(_) => format!("a tool with {teeth} t"),
            Self::Engagement(..) => "another engagement".into(),
            Self::UpForDown => "mirrored at the feed".into(),
            Self::Rotation => "rotates the other way".into(),
            Self::Swapped(_) => "swapped".into(),
            Self::Inverted(quantity, axis) => format!("{} with the opposite sign", name(quantity, axis)),
            Self::AllInverted(quantity) => format!("{} with the opposite sign", all(quantity)),
            Self::Scaled(quantity, axis, _) => format!("{} times", name(quantity, axis)),
            Self::AllScaled(quantity, _) => format!("{} times", all(quantity)),
            Self::Air => "a record of air".into(),
            Self::Clipped(..) => "is clipped".into(),
            Self::MissedPulses(_) => "missed".into(),
            Self::DoubledPulses(_) => "additional".into(),
            Self::Clock(_) => "the sample clock".into(),
            Self::NotANumber(_) => "not a finite number".into(),
            Self::TwoTools => "different tools".into(),
        }
    }

    /// Spoils case and records; `None` if the fault does not apply to them. `other` are records of another tool.
    pub(super) fn spoil(self, case: &mut Case, records: &mut [Recording], other: &[Recording]) -> Option<()> {
        let mut random = ChaCha8Rng::seed_from_u64(77);
        match self {
            Self::Teeth(teeth) => {
                let tool = case.tool.as_mut()?;
                if tool.teeth == teeth {
                    return None;
                }
                tool.teeth = teeth;
                tool.pitch_deg = vec![360.0 / teeth as f64; teeth];
                for record in records {
                    record.sidecar.cut.as_mut()?.teeth = None;
                }
            }
            Self::Engagement(start, exit) => {
                for record in records {
                    let cut = record.sidecar.cut.as_mut()?;
                    cut.start_deg = Some(cut.start_deg? + start).filter(|angle| *angle >= 0.0);
                    cut.exit_deg = Some(cut.exit_deg? + exit).filter(|angle| *angle <= 180.0);
                    cut.start_deg?;
                    cut.exit_deg?;
                }
            }
            Self::UpForDown => {
                for record in records {
                    let cut = record.sidecar.cut.as_mut()?;
                    let [start, exit] = [cut.start_deg?, cut.exit_deg?];
                    if (start + exit - 180.0).abs() < 1.0 {
                        return None;
                    }
                    cut.start_deg = Some(180.0 - exit);
                    cut.exit_deg = Some(180.0 - start);
                }
            }
            Self::Rotation => {
                Self::UpForDown.spoil(case, records, other);
                for record in records {
                    for name in ["fy", "y", "ay"] {
                        scale(record, name, -1.0);
                    }
                }
            }
            Self::Swapped(quantity) => {
                for record in records {
                    let names = of_quantity(record, quantity);
                    let [first, second, ..] = &names[..] else {
                        return None;
                    };
                    let one = samples(record, first)?.clone();
                    let two = std::mem::replace(samples(record, second)?, one);
                    *samples(record, first)? = two;
                }
            }
            Self::Inverted(quantity, axis) => {
                return Self::Scaled(quantity, axis, -1.0).spoil(case, records, other);
            }
            Self::AllInverted(quantity) => {
                return Self::AllScaled(quantity, -1.0).spoil(case, records, other);
            }
            Self::Scaled(quantity, axis, factor) => {
                for record in records {
                    scale(record, &name(quantity, axis), factor).then_some(())?;
                }
            }
            Self::AllScaled(quantity, factor) => {
                for record in records {
                    let names = of_quantity(record, quantity);
                    if names.is_empty() {
                        return None;
                    }
                    for name in names {
                        scale(record, &name, factor);
                    }
                }
            }
            Self::Air => {
                for channel in &mut records[0].channels {
                    if channel.quantity == Quantity::Level {
                        continue;
                    }
                    let count = channel.samples.len() as f64;
                    let size = (channel.samples.iter().map(|x| x * x).sum::<f64>() / count).sqrt();
                    for sample in &mut channel.samples {
                        let deviate: f64 = StandardNormal.sample(&mut random);
                        *sample = 0.02 * size * deviate;
                    }
                }
            }
            Self::Clipped(quantity, share) => {
                let names = of_quantity(&records[0], quantity);
                let own = samples(&mut records[0], names.first()?)?;
                let most = share * own.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                own.iter_mut().for_each(|x| *x = x.clamp(-most, most));
            }
            Self::MissedPulses(every) => {
                let level = samples(&mut records[0], "tacho")?;
                let rises = edges(level);
                for (index, rise) in rises.iter().enumerate().skip(every) {
                    if random.random_range(0..every) == 0 || index == every {
                        let end = rises.get(index + 1).copied().unwrap_or(level.len());
                        let low = level.iter().copied().fold(f64::INFINITY, f64::min);
                        level[*rise - 1..end - 1].fill(low);
                    }
                }
            }
            Self::DoubledPulses(every) => {
                let level = samples(&mut records[0], "tacho")?;
                let rises = edges(level);
                let high = level.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let low = level.iter().copied().fold(f64::INFINITY, f64::min);
                for (index, pair) in rises.windows(2).enumerate().skip(1) {
                    if index % every == 0 {
                        let length = pair[1] - pair[0];
                        level[pair[0] + length / 2..pair[1] - 1].fill(low);
                        let at = pair[0] + 2 * length / 3;
                        level[at..at + (length / 10).max(2)].fill(high);
                    }
                }
            }
            Self::Clock(factor) => {
                for record in records {
                    record.sample_rate_hz *= factor;
                }
            }
            Self::NotANumber(channel) => {
                let at = records[0].len() / 2;
                records[0].channels.get_mut(channel)?.samples[at] = f64::NAN;
            }
            Self::TwoTools => {
                records[1] = other.get(1)?.clone();
                for record in records {
                    record.sidecar.cut.as_mut()?.teeth = None;
                }
            }
        }
        Some(())
    }
}
