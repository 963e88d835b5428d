//! Plausibility of the recordings of a test and of the receptances measured from them.

use std::f64::consts::TAU;

use realfft::RealFftPlanner;

use quietcut_model::structure::Direction;
use quietcut_recording::{Channel, ChannelSummary, Quantity, RecordedCut, Recording, TestKind};

use super::criteria::{
    HUM_SHARE, INVERTED_PHASE, LINE_ABOVE_NEIGHBOURS, ONE_SIGN, PLAUSIBLE_IMPACT_N, PLAUSIBLE_RECEPTANCE,
    PULSE_SHORTER, RINGS_AFTER, SHARE_OF_LINES, SPIKE_ABOVE, SPIKE_NEIGHBOURS, UNRELATED, UNRELATED_PEAK,
};
use super::excitation::Excitation;
use super::hammer;
use super::table::FrfTable;
use super::test_channels::TestChannels;

/// Message about a force and a response that seem to be swapped; `None` if no pair does, or if several forces are
/// selected.
///
/// A hammer's force is short pulses of one sign, and the response rings after them. A force and a response seem to be
/// swapped if the response is such pulses, and the force lasts longer and has more power after the largest of them than
/// before. The powers are not compared if too few samples precede that pulse. They also seem to be swapped if the response
/// is struck by single impacts, and every impact in the force is double, as the pulses of a ringing response are.
pub(super) fn swapped(channels: &TestChannels<'_>) -> Option<String> {
    let [(_, force)] = channels.forces[..] else {
        return None;
    };
    let rate = channels.recording.sample_rate_hz;
    let rings_at_single_impacts = |response: &Channel| {
        hammer::is_struck(&response.samples, rate)
            && hammer::all_impacts_are(false, &response.samples, rate)
            && hammer::all_impacts_are(true, &force.samples, rate)
    };
    let response = channels
        .responses
        .iter()
        .map(|response| response.channel)
        .chain(accelerations(channels))
        .find(|response| {
            are_swapped(&force.samples, &response.samples) || rings_at_single_impacts(response)
        })?;
    Some(format!(
        "{f} and {r} seem to be swapped: {r} has short pulses of one sign, as the force of a hammer, and {f} rings after them, as a response; \
         correct the head, or add --map {f}={r}:{unit_r},{r}={f}:N with the units that hold",
        f = force.name,
        r = response.name,
        unit_r = response.quantity.unit(),
    ))
}

/// Warning that the hardest impact of a hammer test has a force that no hammer measures; `None` for a plausible one.
pub(super) fn impact(force: &Channel, hardest_n: f64) -> Option<String> {
    let [low, high] = PLAUSIBLE_IMPACT_N;
    (!(low..=high).contains(&hardest_n)).then(|| {
        format!(
            "the hardest impact has {hardest_n:.3} N; instrumented hammers measure from some tenths of a N to some 20 000 N: check unit and \
             sensitivity of {name}; if its numbers are N although the file gives another unit, add --map {name}={name}:N",
            name = force.name
        )
    })
}

/// All acceleration channels of the recording, also those that are not selected as responses.
fn accelerations<'a>(channels: &TestChannels<'a>) -> impl Iterator<Item = &'a Channel> {
    channels
        .recording
        .channels
        .iter()
        .filter(|channel| channel.quantity == Quantity::Acceleration)
}

fn are_swapped(force: &[f64], response: &[f64]) -> bool {
    let Some((at, peak)) = largest(response) else {
        return false;
    };
    let is_shorter = PULSE_SHORTER * effective_samples(response) < effective_samples(force);
    if !is_shorter || spike(response).is_some() {
        return false;
    }
    // Samples near the noise have any sign: only those larger in magnitude than a fifth of the peak count.
    let (mut one, mut all) = (0.0, 0.0);
    for sample in response.iter().filter(|sample| sample.abs() > 0.2 * peak.abs()) {
        all += sample * sample;
        if sample * peak > 0.0 {
            one += sample * sample;
        }
    }
    let span = (effective_samples(force) as usize).clamp(1, force.len());
    let energy = |from: usize, to: usize| -> f64 {
        let mean = force.iter().sum::<f64>() / force.len() as f64;
        force[from..to]
            .iter()
            .map(|sample| (sample - mean).powi(2))
            .sum::<f64>()
            / (to - from).max(1) as f64
    };
    let (before, after) = (
        energy(at.saturating_sub(span), at),
        energy(at, (at + span).min(force.len())),
    );
    // For a pulse near the start of the record too few samples precede it for a comparison.
    let rings_after = at < span / 4 || after > RINGS_AFTER * before;
    one > ONE_SIGN * all && rings_after
}

/// Index of the sample of largest magnitude, and this sample with its sign; `None` if all samples are zero, or if there
/// are none.
fn largest(samples: &[f64]) -> Option<(usize, f64)> {
    let at = (0..samples.len()).max_by(|&a, &b| samples[a].abs().total_cmp(&samples[b].abs()))?;
    (samples[at] != 0.0).then_some((at, samples[at]))
}

/// Effective number of samples over which the energy of a signal is spread, (Σx²)²/Σx⁴ with the deviations x from its
/// mean; 0 for a constant signal.
fn effective_samples(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    let (mut second, mut fourth) = (0.0, 0.0);
    for sample in samples {
        let power = (sample - mean).powi(2);
        second += power;
        fourth += power * power;
    }
    if fourth > 0.0 {
        second * second / fourth
    } else {
        0.0
    }
}

/// Warnings about the selected channels of one recording.
pub(super) fn of_channels(excitation: Excitation, channels: &TestChannels<'_>) -> Vec<String> {
    let rate = channels.recording.sample_rate_hz;
    let start_s = channels.recording.start_s;
    let forces = channels.forces.iter().map(|(_, channel)| *channel);
    let responses = channels.responses.iter().map(|response| response.channel);
    let mut warnings = Vec::new();
    // Of these two excitations no part can be left out; of the others, parts with clipped samples are.
    let is_whole = matches!(excitation, Excitation::Sweep | Excitation::StepSine);
    for channel in forces.chain(responses) {
        let name = &channel.name;
        let clipped = ChannelSummary::of(channel, rate, start_s).clipped;
        if clipped > 0 && is_whole {
            warnings.push(format!(
                "{name} is clipped: {clipped} samples stay at its largest or smallest value; receptances from it are wrong: record again with \
                 a larger range of the sensor, or leave the part out with --from-s or --until-s"
            ));
        }
        if let Some(at) = spike(&channel.samples) {
            warnings.push(format!(
                "{name} has a spike of one sample at {:.4} s, far above all others: a fault of cable or converter; leave it out with --from-s \
                 or --until-s, or mend the sample",
                start_s + at as f64 / rate
            ));
        }
    }
    let is_periodic = excitation == Excitation::Random && has_lines(channels, &mut warnings);
    let by_tone = matches!(
        excitation,
        Excitation::Sweep | Excitation::StepSine | Excitation::Multisine
    );
    if !is_periodic && !by_tone {
        warnings.extend(hum(channels));
    }
    warnings
}

/// True if a record is evaluated as random excitation although each force has at least the share [`SHARE_OF_LINES`] of
/// its energy in single frequency lines, as in a cut. Between the lines the receptances are noise.
pub(super) fn is_periodic(excitation: Excitation, channels: &TestChannels<'_>) -> bool {
    excitation == Excitation::Random && least_share_of_lines(channels) >= SHARE_OF_LINES
}

/// Least share of energy in single frequency lines among the selected forces of a record.
fn least_share_of_lines(channels: &TestChannels<'_>) -> f64 {
    let shares = channels
        .forces
        .iter()
        .map(|(_, force)| share_of_lines(&force.samples));
    shares.fold(1.0, f64::min)
}

/// Appends a warning and returns true if each force has at least the share [`SHARE_OF_LINES`] of its energy in single
/// frequency lines, as in a cut.
fn has_lines(channels: &TestChannels<'_>, warnings: &mut Vec<String>) -> bool {
    let share = least_share_of_lines(channels);
    if share < SHARE_OF_LINES {
        return false;
    }
    let remedy = if is_cut(channels.recording) {
        "an ordinary cut shows nothing between the tooth passings, where these receptances are noise; do not use them: for receptances record a \
         tap test; quietcut replay REC --teeth N looks for chatter in a cut, quietcut diagnose CASE REC compares it with a case of the machine"
    } else {
        "between its lines nothing is excited, and the receptances there are noise: for a stepped sine say --excitation step-sine, for a \
         multisine of whole periods --excitation multisine, for a cut use quietcut diagnose CASE REC or quietcut replay REC"
    };
    warnings.push(format!(
        "the force has no impact and is no broad-band force, but periodic: {:.0} % of its energy is in single lines; {remedy}",
        100.0 * share
    ));
    true
}

/// True if the sidecar of a recording says that it is of a cut or gives a parameter of a cut, or if the recording has a
/// channel `tacho`.
pub(super) fn is_cut(recording: &Recording) -> bool {
    let sidecar = &recording.sidecar;
    sidecar.kind == Some(TestKind::Cutting)
        || sidecar.cut.is_some_and(|cut| cut != RecordedCut::default())
        || recording.channel("tacho").is_some()
}

/// Largest number of samples of a record that are searched for frequency lines (its middle) and for hum (its start); a
/// choice.
const LONGEST: usize = 1 << 17;

/// Share of the energy of a signal, without its mean, that lies in peaks of the spectrum well above the lines around
/// them; 0 with fewer than 256 samples.
fn share_of_lines(samples: &[f64]) -> f64 {
    // The length of the transform is a power of two.
    let length = match samples.len().min(LONGEST) {
        0..=255 => return 0.0,
        length => 1 << length.ilog2(),
    };
    let first = (samples.len() - length) / 2;
    let part = &samples[first..first + length];
    let mean = part.iter().sum::<f64>() / length as f64;
    let plan = RealFftPlanner::new().plan_fft_forward(length);
    let mut input: Vec<f64> = part
        .iter()
        .enumerate()
        .map(|(k, sample)| (sample - mean) * 0.5 * (1.0 - (TAU * k as f64 / length as f64).cos()))
        .collect();
    let mut spectrum = plan.make_output_vec();
    if plan.process(&mut input, &mut spectrum).is_err() {
        return 0.0;
    }
    let power: Vec<f64> = spectrum.iter().map(|line| line.norm_sqr()).collect();
    let total: f64 = power.iter().sum();
    let mut is_line = vec![false; power.len()];
    for at in 2..power.len().saturating_sub(2) {
        let is_peak = power[at] >= power[at - 1] && power[at] > power[at + 1];
        if !is_peak || power[at] < 1e-6 * total {
            continue;
        }
        let mut around: Vec<f64> = (at.saturating_sub(NEIGHBOURS)..(at + NEIGHBOURS).min(power.len()))
            .filter(|line| line.abs_diff(at) > MAIN_LOBE)
            .map(|line| power[line])
            .collect();
        around.sort_by(f64::total_cmp);
        let median = around.get(around.len() / 2).copied().unwrap_or(0.0);
        if power[at] > LINE_ABOVE_NEIGHBOURS * median {
            is_line[at.saturating_sub(MAIN_LOBE)..=(at + MAIN_LOBE).min(power.len() - 1)].fill(true);
        }
    }
    let in_lines: f64 = power
        .iter()
        .zip(&is_line)
        .filter(|(_, is_line)| **is_line)
        .map(|(power, _)| power)
        .sum();
    if total > 0.0 { in_lines / total } else { 0.0 }
}

/// Half the number of lines in the range around a peak whose lines, except for its [`MAIN_LOBE`], the peak is compared
/// with; a choice.
const NEIGHBOURS: usize = 32;

/// Number of lines on each side of a peak that belong to it with a Hann window.
const MAIN_LOBE: usize = 2;

/// Warnings about hum of the mains: one for each selected channel in which it carries more than the share [`HUM_SHARE`]
/// of the energy.
fn hum(channels: &TestChannels<'_>) -> Vec<String> {
    let rate = channels.recording.sample_rate_hz;
    let forces = channels.forces.iter().map(|(_, channel)| *channel);
    let responses = channels.responses.iter().map(|response| response.channel);
    forces
        .chain(responses)
        .filter_map(|channel| {
            let (share, hertz) = [50.0, 60.0]
                .into_iter()
                .filter(|hertz| 2.0 * hertz < rate)
                .map(|hertz| (share_near(&channel.samples, rate, hertz), hertz))
                .max_by(|a, b| a.0.total_cmp(&b.0))?;
            (share > HUM_SHARE).then(|| {
                format!(
                    "{name} is mostly hum of the mains: {:.0} % of its energy is at {hertz} Hz; check cable, shield and earthing of the sensor \
                     and record again; receptances near {hertz} Hz and its multiples are wrong",
                    100.0 * share,
                    name = channel.name
                )
            })
        })
        .collect()
}

/// Longest part of a record, s, in which hum of the mains is searched. The lines of such a part are 0.01 Hz apart, and
/// the search within 0.2 Hz tries about 81 frequencies. A choice.
const HUM_S: f64 = 100.0;

/// Largest share of the energy of a signal, without its mean, in one sine within 0.2 Hz of `hertz`; 0 for a constant
/// signal and with fewer than 16 samples. Only the start of the signal counts, see [`LONGEST`] and [`HUM_S`]. In normal
/// operation the mains stay within 0.2 Hz.
fn share_near(samples: &[f64], rate: f64, hertz: f64) -> f64 {
    let samples = &samples[..samples.len().min(LONGEST).min((HUM_S * rate).ceil() as usize)];
    let count = samples.len() as f64;
    let mean = samples.iter().sum::<f64>() / count.max(1.0);
    let energy: f64 = samples.iter().map(|sample| (sample - mean).powi(2)).sum();
    if energy <= 0.0 || samples.len() < 16 {
        return 0.0;
    }
    // Half the distance of independent lines: the amplitude of a sine between two steps is at most 10 % too low.
    let step = 0.5 * rate / count;
    let steps = (0.2 / step).ceil().max(0.0) as i32;
    (-steps..=steps)
        .map(|index| {
            let turn = TAU * (hertz + f64::from(index) * 0.2 / f64::from(steps.max(1))) / rate;
            let (mut re, mut im) = (0.0, 0.0);
            // Rotation by a constant angle replaces a sine for each sample.
            let (sin, cos) = turn.sin_cos();
            let (mut c, mut s) = (1.0, 0.0);
            for sample in samples {
                re += (sample - mean) * c;
                im += (sample - mean) * s;
                (c, s) = (c * cos - s * sin, s * cos + c * sin);
            }
            2.0 * (re * re + im * im) / count / energy
        })
        .fold(0.0, f64::max)
}

/// Index of a spike: one sample much farther from the median than all others ([`SPIKE_ABOVE`], [`SPIKE_NEIGHBOURS`]).
/// `None` if there is no such sample, or if all other samples equal the median.
fn spike(samples: &[f64]) -> Option<usize> {
    let mut sorted: Vec<f64> = samples.to_vec();
    let middle = sorted.len().checked_sub(1)? / 2;
    let (_, rest, _) = sorted.select_nth_unstable_by(middle, f64::total_cmp);
    let rest = *rest;
    let size = |at: usize| samples.get(at).map_or(0.0, |sample| (sample - rest).abs());
    let at = (0..samples.len()).max_by(|&a, &b| size(a).total_cmp(&size(b)))?;
    let peak = size(at);
    let neighbours = size(at + 1).max(at.checked_sub(1).map_or(0.0, size));
    let others = (0..samples.len())
        .filter(|other| *other != at)
        .map(size)
        .fold(0.0, f64::max);
    (peak > 0.0 && neighbours < SPIKE_NEIGHBOURS * peak && others < peak / SPIKE_ABOVE && others > 0.0)
        .then_some(at)
}

/// Doubts about a table of receptances at the tool tip that another program wrote, each in words: a drive point that feeds
/// energy in, a response that the force hardly causes, a peak that no structure has.
pub fn table_doubts(table: &FrfTable) -> Vec<String> {
    of_table(table, Origin::Table, true)
}

/// Where receptances come from, which decides how a wrong sign is mended.
#[derive(Clone, Copy)]
pub(super) enum Origin {
    Recordings,
    Table,
}

impl Origin {
    fn remedy(self, axis: Direction) -> String {
        match self {
            Self::Recordings => format!(
                "one of them points against its axis: add --map a{axis}=-a{axis} if it is the sensor, or --map f{axis}=-f{axis} if the hammer strikes \
                 against the axis (with the names of your columns)"
            ),
            Self::Table => "one of them pointed against its axis, or the phase is that of e^(−iωt): change the sign of the imaginary part, and of the \
                            real part too if that is negative below the first resonance, in the program that wrote the table"
                .into(),
        }
    }
}

/// Warnings about measured receptances: a drive point that feeds energy in, a response that the force hardly causes,
/// and a peak outside the plausible range. Drive points are checked only on demand: between
/// the lines of a periodic force the receptance is noise, and a force and a sensor at two points are no drive point.
pub(super) fn of_table(table: &FrfTable, origin: Origin, checks_drive_points: bool) -> Vec<String> {
    let frequency_hz = table.frequency_hz();
    let mut warnings = Vec::new();
    for entry in table.entries() {
        let name = entry.name();
        let size = |line: usize| entry.receptance[line].norm();
        let peak = entry.peak_line();
        // The mean of the sine of the phase over the related lines, weighted with the square of the mobility |ωH|. At a
        // resonance of a passive drive point the sine is −1. Lines whose response is mostly noise have any phase, and may
        // have the largest |H|: the noise of an accelerometer, divided by ω², at the first lines.
        let related = || (0..entry.receptance.len()).filter(|line| entry.is_related(*line));
        let mobility = |line: usize| frequency_hz[line] * entry.receptance[line].norm();
        let (imaginary, power) = related().fold((0.0, 0.0), |(sum, all), line| {
            let h = entry.receptance[line];
            let weight = frequency_hz[line] * frequency_hz[line];
            (sum + weight * h.im * h.norm(), all + weight * h.norm_sqr())
        });
        let phase = if power > 0.0 { imaginary / power } else { 0.0 };
        let resonance = related().max_by(|&a, &b| mobility(a).total_cmp(&mobility(b)));
        let coherence = entry.coherence.as_ref().map(|coherence| {
            let mut sorted = coherence.clone();
            sorted.sort_by(f64::total_cmp);
            (coherence[peak], sorted[sorted.len() / 2])
        });
        let is_unrelated =
            coherence.is_some_and(|(at_peak, median)| at_peak < UNRELATED_PEAK && median < UNRELATED);
        if let Some((at_peak, median)) = coherence.filter(|_| is_unrelated) {
            warnings.push(format!(
                "H{name}: little of the response comes from the force: its coherence is {at_peak:.2} at the peak and {median:.2} in the median; check the \
                 sensor in {} (dead, loose, wrong channel), the cable, and the length of the record",
                entry.response
            ));
        } else if checks_drive_points && entry.response == entry.force && phase > INVERTED_PHASE {
            warnings.push(format!(
                "H{name} has the sign of an inverted sensor: its imaginary part is positive at {:.3} Hz, where a drive point takes up energy \
                 and has a negative one; if force and sensor sit at one point, {}",
                frequency_hz[resonance.unwrap_or(peak)],
                origin.remedy(entry.response)
            ));
        }
        let [low, high] = PLAUSIBLE_RECEPTANCE;
        if !is_unrelated && !(low..=high).contains(&size(peak)) && size(peak) > 0.0 {
            let (is, than) = if size(peak) > high {
                ("large", "above")
            } else {
                ("small", "below")
            };
            let bound = if size(peak) > high { high } else { low };
            let digits = if size(peak) > high { 0 } else { 9 };
            warnings.push(format!(
                "H{name} is implausibly {is}: its peak is {:.digits$} µm/N, {than} {} µm/N; check the units and sensitivities of force and response",
                1e6 * size(peak),
                1e6 * bound
            ));
        }
    }
    warnings
}

#[cfg(test)]
mod tests;
