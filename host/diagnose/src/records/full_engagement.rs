//! The segment of a recorded cut with full engagement.
//!
//! A case describes a cut with its whole radial engagement and axial depth. Recordings of real cuts begin and end in
//! air, and during entry and exit the tool crosses a face of the workpiece, where the case does not define the chips.
//! Therefore only the segment with full engagement is compared. A revolution counts as air only if the vibration of one
//! channel is small both against the median over the revolutions of the recording and against the response of the
//! baseline to the feed alone. The second condition is needed because chatter exceeds the response to the feed by far:
//! before chatter has grown, the vibration of a revolution is small against that of later ones, although the tool is
//! not in air.

use quietcut_numerics::statistics::median;
use std::borrow::Cow;
use std::f64::consts::TAU;
use std::ops::Range;

use nalgebra::Vector3;
use num_complex::Complex64;

use crate::baseline::{Baseline, derivatives};
use crate::criteria::{
    AIR_LEVEL, AIR_OVER_NOISE, CHATTER_LEVEL, ENGAGED_LEVEL, ENGAGEMENT_AFTER_LEVEL, ENTRY_MARGIN,
    EXIT_SHARE, GROWTH_FROM_REST, LEAST_AIR_AT_ENDS, LEAST_AIR_WITHIN, LEAST_ENGAGED_REVOLUTIONS,
};
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::cut_of;
use crate::motion::spindle_motion::SpindleMotion;
use crate::signal::noise::{floor_between_lines, rms};
use quietcut_model::case::Case;
use quietcut_recording::{Quantity, Recording, TestKind};
use quietcut_simulate::effect::Pickup;
use quietcut_simulate::{Cutter, Spindle, WorkpieceTraverse};

/// Number of spindle angles per revolution at which the cutting force of the feed alone is evaluated.
const ANGLES: usize = 512;

/// The recordings, each shortened to its segment of full engagement, and warnings: one for each shortened recording,
/// and one more if its tool has no diameter. Recordings of other tests stay as they are, and so do cuts for which
/// [`engaged`] gives none.
///
/// # Errors
/// The case cannot be simulated, or a recording has too few revolutions of full engagement.
pub(crate) fn in_full_engagement<'a>(
    case: &Case,
    recordings: &'a [Recording],
) -> Result<(Cow<'a, [Recording]>, Vec<String>), DiagnoseError> {
    let mut remarks = Vec::new();
    let mut shortened = Cow::Borrowed(recordings);
    if !recordings.iter().any(is_of_a_cut) {
        return Ok((shortened, remarks));
    }
    let baseline = Baseline::new(case)?;
    for (index, recording) in recordings.iter().enumerate() {
        let Some(Engaged { range, has_diameter }) = engaged(&baseline, recording) else {
            continue;
        };
        let [from_s, to_s] = [range.start, range.end].map(|sample| recording.time_s(sample));
        let revolutions = (to_s - from_s) / SpindleMotion::new(recording, None)?.revolution_s();
        if revolutions < LEAST_ENGAGED_REVOLUTIONS {
            return Err(DiagnoseError::record(
                &recording.path,
                format!(
                    "contains only {revolutions:.1} revolutions of full engagement (from {from_s:.3} s); at least \
                     {LEAST_ENGAGED_REVOLUTIONS} are required"
                ),
            ));
        }
        remarks.push(format!(
            "{}: full engagement from {from_s:.3} to {to_s:.3} s is diagnosed; the rest is air, entry or exit of the tool",
            recording.path.display()
        ));
        if !has_diameter {
            remarks.push(format!(
                "{}: entry and exit of the tool are estimated from the vibration, because the tool has no diameter: give diameter_mm in [tool]",
                recording.path.display()
            ));
        }
        shortened.to_mut()[index] = recording.part(range);
    }
    Ok((shortened, remarks))
}

fn is_of_a_cut(recording: &Recording) -> bool {
    recording.sidecar.kind == Some(TestKind::Cutting)
}

/// Range of the samples of a recorded cut in which the tool is fully engaged.
#[derive(Debug, PartialEq)]
struct Engaged {
    range: Range<usize>,
    /// False if the tool has no diameter, so that the times of entry and exit are estimated from the level of the
    /// vibration.
    has_diameter: bool,
}

/// The samples of a recorded cut with full engagement; `None` if the recording is not of a cut, lacks a usable
/// tachometer or another value, shows no air, has no channel with vibration above its noise (see [`Levels::of()`]), or
/// if the longest range of revolutions not in air contains none in which all these channels reach `ENGAGED_LEVEL`.
fn engaged(baseline: &Baseline<'_>, recording: &Recording) -> Option<Engaged> {
    if !is_of_a_cut(recording) {
        return None;
    }
    // A recording without a usable tachometer is refused when its record is prepared.
    let revolution_s = SpindleMotion::new(recording, None).ok()?.revolution_s();
    let cutter = cutter(baseline, recording, 60.0 / revolution_s)?;
    let levels = Levels::of(
        baseline,
        recording,
        revolution_s,
        &Forced::new(baseline, &cutter, revolution_s),
    )?;
    let cut = longest_gap(&levels.in_air(), levels.count)?;
    let is_engaged = |revolution: &usize| levels.smallest(*revolution) >= ENGAGED_LEVEL;
    let first = cut.clone().find(is_engaged)?;
    let last = cut.clone().rev().find(is_engaged)?;
    let by_diameter = WorkpieceTraverse::entry_duration_s(&cutter, &Spindle::new(60.0 / revolution_s)).ok();
    let engaged_after = ENGAGEMENT_AFTER_LEVEL * (first - cut.start) as f64;
    let way = by_diameter.map_or(engaged_after, |seconds| seconds / revolution_s);
    let from = match cut.start {
        0 => 0.0,
        start => start as f64 + (ENTRY_MARGIN * way).max(engaged_after) + 1.0,
    };
    // The recording may end with the cut, before the vibration has decayed; then its end is kept. Otherwise at least
    // the duration of the exit is cut off, times `ENTRY_MARGIN` in chatter, which stays large until the tool has left
    // the workpiece, and times `EXIT_SHARE` in a stable cut.
    let to = if cut.end == levels.count && cut.end - last <= LEAST_AIR_AT_ENDS {
        f64::INFINITY
    } else {
        let engaged_before = ENGAGEMENT_AFTER_LEVEL * (cut.end - 1 - last) as f64;
        let out = if levels.chatters { ENTRY_MARGIN } else { EXIT_SHARE };
        cut.end as f64 - (out * way).max(engaged_before) - 1.0
    };
    let sample = |revolution: f64| {
        ((revolution * revolution_s * recording.sample_rate_hz).max(0.0) as usize).min(recording.len())
    };
    let (from, to) = (sample(from), sample(to));
    Some(Engaged {
        range: from..to.max(from),
        has_diameter: by_diameter.is_some(),
    })
}

/// The tool in its cut at the mean spindle speed `rpm`, rev/min; `None` if a required value is missing or wrong, which
/// the preparation of the record reports as an error.
fn cutter(baseline: &Baseline<'_>, recording: &Recording, rpm: f64) -> Option<Cutter> {
    let case = baseline.case;
    let depth_mm = recording.sidecar.cut?.axial_depth_mm?;
    let cut = cut_of(case, recording).ok()?;
    let cutter = Cutter::new(case.tool().ok()?, case.material().ok()?, &cut, 1e-3 * depth_mm).ok()?;
    baseline.effects.cutter(cutter.at_speed(rpm)).ok()
}

/// Cutting force of the feed alone and response of the baseline to it: complex amplitudes of force, N, and
/// displacement, m, at the harmonics 1, 2 … of the spindle frequency `omega`, rad/s.
struct Forced {
    omega: f64,
    harmonics: Vec<[Vector3<Complex64>; 2]>,
}

impl Forced {
    fn new(baseline: &Baseline<'_>, cutter: &Cutter, revolution_s: f64) -> Self {
        let omega = TAU / revolution_s;
        let forces_n: Vec<Vector3<f64>> = (0..ANGLES)
            .map(|index| TAU * index as f64 / ANGLES as f64)
            .map(|angle_rad| force_n(cutter, angle_rad))
            .collect();
        let harmonics = (1..ANGLES / 2)
            .map(|harmonic| {
                let force = forces_n
                    .iter()
                    .enumerate()
                    .map(|(index, force)| {
                        let angle_rad = TAU * ((harmonic * index) % ANGLES) as f64 / ANGLES as f64;
                        force.map(|force| Complex64::from_polar(2.0 * force / ANGLES as f64, -angle_rad))
                    })
                    .sum::<Vector3<Complex64>>();
                [force, baseline.receptance.at(harmonic as f64 * omega) * force]
            })
            .collect();
        Self { omega, harmonics }
    }

    /// Standard deviation over a revolution that the feed alone causes in a channel, in the channel's SI unit, from the
    /// harmonics of the spindle frequency below half the sample rate.
    fn level(&self, pickup: &Pickup, rate_hz: f64) -> f64 {
        let squares = self.harmonics.iter().enumerate().map(|(index, [force, x])| {
            let omega = (index + 1) as f64 * self.omega;
            if omega >= 0.5 * TAU * rate_hz {
                return 0.0;
            }
            let (vector, factor) = match pickup.quantity {
                Quantity::Force => (force, 1.0),
                quantity => (x, omega.powi(derivatives(quantity))),
            };
            let read =
                |part: fn(&Complex64) -> f64| pickup.read(std::array::from_fn(|axis| part(&vector[axis])));
            0.5 * (factor * read(|value| value.re).hypot(read(|value| value.im))).powi(2)
        });
        squares.sum::<f64>().sqrt()
    }
}

/// Cutting force at one spindle angle on a rigid tool without runout, whose teeth all advance by the mean feed per
/// tooth, N.
fn force_n(cutter: &Cutter, angle_rad: f64) -> Vector3<f64> {
    let arc = cutter.exit_rad - cutter.start_rad;
    cutter
        .teeth
        .iter()
        .map(|tooth| angle_rad + tooth.angle_rad)
        .filter(|phi_rad| (phi_rad - cutter.start_rad).rem_euclid(TAU) < arc)
        .map(|phi_rad| {
            let immersion = cutter.immersion(phi_rad);
            let thickness_m = cutter.recession_m(immersion, cutter.feed_per_tooth_m);
            Vector3::from(
                cutter
                    .force
                    .force_n(immersion, thickness_m.max(0.0), cutter.depth_m),
            )
        })
        .sum()
}

/// Vibration level of each channel that exceeds its noise enough, in each revolution of a recorded cut: the standard
/// deviation of the channel, without its noise, over a reference. The reference is the median of the standard deviation
/// over the revolutions, or the standard deviation that the feed alone causes if that is smaller, as in chatter.
struct Levels {
    count: usize,
    /// True if the median standard deviation of some channel of `of` over the revolutions is more than `CHATTER_LEVEL`
    /// times the one that the feed alone causes.
    chatters: bool,
    /// Vibration levels by channel (those that exceed their noise enough) and revolution.
    of: Vec<Vec<f64>>,
    /// Standard deviation of the noise of each channel of `of`, divided by the same reference as the vibration levels
    /// of the channel.
    noise: Vec<f64>,
}

impl Levels {
    /// Computes the vibration levels of a recording. Of the channels that the baseline knows, those count whose
    /// reference exceeds `AIR_OVER_NOISE` times their noise; `None` if there is none.
    fn of(
        baseline: &Baseline<'_>,
        recording: &Recording,
        revolution_s: f64,
        forced: &Forced,
    ) -> Option<Self> {
        let rate_hz = recording.sample_rate_hz;
        let per_revolution = revolution_s * rate_hz;
        let count = (recording.len() as f64 / per_revolution) as usize;
        let mut levels = Self {
            count,
            chatters: false,
            of: Vec::new(),
            noise: Vec::new(),
        };
        for channel in &recording.channels {
            let Some(pickup) = baseline.pickup(&channel.name) else {
                continue;
            };
            let noise = floor_between_lines(&channel.samples, rms(&channel.samples));
            let revolutions: Vec<f64> = (0..count)
                .map(|revolution| {
                    [revolution, revolution + 1]
                        .map(|revolution| (revolution as f64 * per_revolution) as usize)
                })
                .map(|[from, to]| deviation(&channel.samples[from..to], noise))
                .collect();
            let (median_level, feed_level) = (
                median(&mut revolutions.clone()).unwrap_or(0.0),
                forced.level(&pickup, rate_hz),
            );
            let in_cut = median_level.min(feed_level);
            if in_cut > AIR_OVER_NOISE * noise {
                levels.chatters |= median_level > CHATTER_LEVEL * feed_level;
                levels
                    .of
                    .push(revolutions.iter().map(|level| level / in_cut).collect());
                levels.noise.push(noise / in_cut);
            }
        }
        (!levels.of.is_empty()).then_some(levels)
    }

    fn smallest(&self, revolution: usize) -> f64 {
        self.of
            .iter()
            .map(|of| of[revolution])
            .fold(f64::INFINITY, f64::min)
    }

    /// Ranges of successive revolutions in air, by the smallest vibration level of all channels: at least
    /// `LEAST_AIR_AT_ENDS` revolutions at an end of the recording, `LEAST_AIR_WITHIN` elsewhere. A range at the
    /// beginning does not count if the vibration grows from rest.
    fn in_air(&self) -> Vec<Range<usize>> {
        let mut in_air = Vec::new();
        let mut revolution = 0;
        while revolution < self.count {
            let from = revolution;
            while revolution < self.count && self.smallest(revolution) < AIR_LEVEL {
                revolution += 1;
            }
            let is_at_end = from == 0 || revolution == self.count;
            let fewest = if is_at_end {
                LEAST_AIR_AT_ENDS
            } else {
                LEAST_AIR_WITHIN
            };
            if revolution - from >= fewest && (from > 0 || !self.grows_from_rest()) {
                in_air.push(from..revolution);
            }
            revolution += 1;
        }
        in_air
    }

    /// True if every channel whose vibration level is below `AIR_LEVEL` in the first revolution exceeds, in the second,
    /// `GROWTH_FROM_REST` times that level plus the noise, as when a cut begins with the recording. False if such a
    /// channel has no second revolution.
    fn grows_from_rest(&self) -> bool {
        self.of
            .iter()
            .zip(&self.noise)
            .filter(|(of, _)| of[0] < AIR_LEVEL)
            .all(|(of, noise)| {
                of.get(1)
                    .is_some_and(|next| *next > GROWTH_FROM_REST * of[0] + noise)
            })
    }
}

/// Square root of the variance of the samples less the noise variance; 0 if the noise variance is larger.
fn deviation(samples: &[f64], noise: f64) -> f64 {
    let count = samples.len().max(1) as f64;
    let mean = samples.iter().sum::<f64>() / count;
    let square = samples.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / count;
    (square - noise * noise).max(0.0).sqrt()
}

/// The longest range of revolutions that is not in air, of `count` revolutions, given the ranges in air; `None` if
/// there is no range in air.
fn longest_gap(in_air: &[Range<usize>], count: usize) -> Option<Range<usize>> {
    if in_air.is_empty() {
        return None;
    }
    let starts = std::iter::once(0).chain(in_air.iter().map(|air| air.end));
    let ends = in_air.iter().map(|air| air.start).chain([count]);
    starts.zip(ends).map(|(from, to)| from..to).max_by_key(Range::len)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conclusion::answer::Outcome;
    use crate::tests::virtual_records::{case, record};
    use crate::{Options, diagnose};
    use quietcut_simulate::{Entry, VirtualCut};

    /// Time in which the tool crosses a face of the workpiece at 900 rev/min with two teeth and a feed of 0.15 mm per
    /// tooth, s: tool radius over feed rate.
    const WAY_S: f64 = 6.35 / (0.3 * 15.0);
    const SECONDS: f64 = 8.0;
    const AIR_S: f64 = 0.2;
    const SLOT: &str = "kuka-kr90-full";

    fn entering(entry: Entry, depth_mm: f64, seconds: f64) -> VirtualCut {
        VirtualCut {
            entry,
            ..VirtualCut::new(900.0, depth_mm, seconds)
        }
    }

    fn recorded(case: &Case, cut: VirtualCut, measured: &[Quantity], noise: f64) -> Recording {
        let cut = VirtualCut {
            measured: measured.to_vec(),
            ..cut
        };
        record(case, &cut, "cut.csv", 1000.0, noise, 3)
    }

    #[test]
    fn the_segment_found_is_in_full_engagement() {
        use Quantity::{Acceleration, Displacement, Force};
        let ramp = Entry::Ramp { seconds: 1.0 };
        for (name, depth_mm, entry, measured, noise) in [
            (SLOT, 1.0, Entry::Feed, &[Force, Displacement][..], 0.005),
            (SLOT, 1.0, Entry::Feed, &[Displacement], 0.005),
            (SLOT, 1.0, Entry::Feed, &[Acceleration], 0.05),
            // At 3 mm chatter grows over the whole cut.
            (SLOT, 3.0, Entry::Feed, &[Displacement], 0.005),
            (SLOT, 1.0, ramp, &[Displacement], 0.005),
            ("kuka-kr90-acetal", 1.0, Entry::Feed, &[Force, Acceleration], 0.02),
        ] {
            let case = case(name, "");
            let recording = recorded(&case, entering(entry, depth_mm, SECONDS), measured, noise);
            let Engaged { range, .. } = engaged(&Baseline::new(&case).unwrap(), &recording).unwrap();
            let [from_s, to_s] = [range.start, range.end].map(|sample| recording.time_s(sample));
            println!("{name} {depth_mm} mm {entry:?} {measured:?}: {from_s} to {to_s} s");
            // The tool first touches the workpiece at `AIR_S` from the start of the recording, and leaves it at `AIR_S`
            // from the end. Slow free decays after the exit resemble a part of the cut.
            let way_s = if entry == ramp { 1.0 } else { WAY_S };
            let touches = [AIR_S, SECONDS - AIR_S];
            assert!(from_s >= touches[0] + way_s && from_s < touches[0] + 1.6 * WAY_S);
            assert!(to_s <= touches[1] - way_s && to_s > touches[1] - 2.0 * WAY_S);
        }
    }

    #[test]
    fn a_recording_of_one_revolution_does_not_grow_from_rest() {
        let levels = Levels {
            count: 1,
            chatters: false,
            of: vec![vec![0.5 * AIR_LEVEL]],
            noise: vec![0.0],
        };
        assert!(!levels.grows_from_rest());
        assert_eq!(levels.smallest(0), 0.5 * AIR_LEVEL);
    }

    #[test]
    fn a_recording_without_air_is_not_shortened() {
        for (depth_mm, measured) in [
            (1.0, Quantity::Displacement),
            (1.0, Quantity::Acceleration),
            // At 4 mm the vibration grows into chatter.
            (4.0, Quantity::Displacement),
        ] {
            let case = case(SLOT, "");
            let recording = recorded(
                &case,
                entering(Entry::None, depth_mm, SECONDS),
                &[measured],
                0.005,
            );
            let engaged = engaged(&Baseline::new(&case).unwrap(), &recording);
            assert_eq!(engaged, None, "{depth_mm} mm, {measured:?}");
        }
    }

    #[test]
    fn a_cut_is_diagnosed_in_its_segment_of_full_engagement() {
        // Speed modulation and wear are functions of the time from the start of the recording, not from the start of
        // full engagement.
        let modulation =
            "\n[extension.speed-fluctuation]\ndelta = 0.01\nfrequency_hz = 0.7\nphase_deg = 40.0\n";
        let wear = "\n[extension.wear]\nrelative_rate_per_s = 0.1\n";
        let (cut, believed) = (case(SLOT, &[modulation, wear].concat()), case(SLOT, modulation));
        let measured = [Quantity::Displacement];
        let recording = recorded(&cut, entering(Entry::Feed, 1.0, SECONDS), &measured, 0.005);
        let diagnosed = |case: &Case| {
            let recordings = std::slice::from_ref(&recording);
            let diagnosis = diagnose(case, recordings, &Options::default()).unwrap();
            let said = &diagnosis.warnings[0];
            assert!(said.starts_with("cut.csv: full engagement from 1.9"), "{said}");
            diagnosis
        };
        assert_eq!(diagnosed(&cut).outcome, Outcome::None);
        let diagnosis = diagnosed(&believed);
        let [cause] = &diagnosis.causes[..] else {
            panic!("{:?}", diagnosis.causes)
        };
        assert_eq!(cause.name, "wear");
        println!("{:?}", cause.parameters);
        for figure in cause.parameters.values() {
            assert!((figure.value / 0.1 - 1.0).abs() < 0.05, "{figure:?}");
        }
    }

    #[test]
    fn a_tool_without_diameter_is_reported() {
        let mut case = case(SLOT, "");
        let cut = entering(Entry::Feed, 1.0, SECONDS);
        let recording = recorded(&case, cut, &[Quantity::Displacement], 0.005);
        let remarks = |case: &Case| {
            let recordings = std::slice::from_ref(&recording);
            in_full_engagement(case, recordings).unwrap().1
        };
        assert_eq!(remarks(&case).len(), 1);
        case.tool.as_mut().unwrap().diameter_mm = None;
        let remarks = remarks(&case);
        assert!(
            remarks.len() == 2 && remarks[1].contains("give diameter_mm"),
            "{remarks:?}"
        );
    }

    #[test]
    fn a_segment_with_too_few_revolutions_is_refused() {
        let case = case(SLOT, "");
        let short = entering(Entry::Feed, 1.0, 2.0 * (AIR_S + WAY_S) + 0.2);
        let recording = recorded(&case, short, &[Quantity::Displacement], 0.005);
        let error = diagnose(&case, &[recording], &Options::default()).unwrap_err();
        let said = error.to_string();
        assert!(said.ends_with("at least 8 are required"), "{said}");
    }
}
