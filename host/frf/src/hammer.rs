//! Impacts of a hammer test: detection, double impacts, and the windows of force and response.

use quietcut_numerics::statistics::median;

use super::FrfError;
use super::clipping::Clipping;
use super::criteria::{
    BOUNCE_S, LEAST_IMPACT, PULSE_ABOVE_NOISE, PULSE_END, PULSE_END_ABOVE_NOISE, SECOND_PULSE, STRUCK_ENERGY,
    STRUCK_SHARE,
};
use super::test_channels::TestChannels;

/// Length of the part of a hammer segment before the force pulse, as a fraction of the segment length. The mean of each
/// signal over this part is subtracted from its segment as the offset of the sensor. A choice.
const BEFORE: f64 = 0.01;

/// One impact of the hammer.
#[derive(Clone, Debug, PartialEq)]
pub struct MeasuredImpact {
    /// Time of the force peak, s, from the start of the record.
    pub time_s: f64,
    /// Peak force, N, with its sign, relative to the median force of the record.
    pub peak_n: f64,
    /// Second force pulse within the segment: delay after the first peak, s, and height without sign as a fraction of
    /// that peak; `None` for a single impact, and for impacts that are left out for another reason.
    pub second: Option<(f64, f64)>,
    /// Index of the first sample of the force pulse of this impact in the record.
    first: usize,
    /// Index of the last sample of the force pulse of this impact in the record.
    last: usize,
}

/// Segment length and exponential window of a hammer test.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HammerWindows {
    /// Length of the segment of each impact, s. `None` for the inverse of the frequency resolution or, if none is set,
    /// for the greatest length with which segments neither overlap nor exceed the end of their record in any hammer
    /// test that is measured together.
    pub segment_s: Option<f64>,
    /// Time constant τ of the exponential window on force and response, s, which begins with the force pulse; `None`
    /// for no window.
    ///
    /// With e^{−t/τ} on both signals the FRF is H(iω + 1/τ): every pole λ moves to λ − 1/τ. [`measure`](crate::measure)
    /// removes the damping that the window adds.
    pub exponential_s: Option<f64>,
}

/// Windowed segments of the impacts of one hammer record.
pub(super) struct ImpactSegments {
    /// Windowed signals: the force, then the responses in the order of the channels. Each signal is the segments of the
    /// `used` impacts one after the other.
    pub(super) signals: Vec<Vec<f64>>,
    /// Number of samples in the segment of each impact; it is even and equal for all impacts.
    pub(super) length: usize,
    /// Single impacts, whose segments are evaluated.
    pub(super) used: Vec<MeasuredImpact>,
    /// Double impacts, whose segments are not evaluated.
    pub(super) double: Vec<MeasuredImpact>,
    /// Impacts with clipped samples in their segments, which are not evaluated.
    pub(super) clipped: Vec<MeasuredImpact>,
    /// Impacts too close to the start or end of the record for a segment, which are not evaluated.
    pub(super) cut_short: Vec<MeasuredImpact>,
    /// Largest amplitude of a windowed response at the end of a segment, as a fraction of the peak of that response in
    /// the segment, over all responses and segments.
    pub(super) end_amplitude: f64,
}

/// Cuts a record into one windowed segment per single impact; double and clipped impacts, and impacts without a whole
/// segment in the record, are left out.
///
/// # Errors
/// The record has several forces, no impact, or no impact with a whole segment; all impacts with a segment are clipped
/// or double; or the segments have fewer than 16 samples.
pub(super) fn segments(
    channels: &TestChannels<'_>,
    windows: HammerWindows,
) -> Result<ImpactSegments, FrfError> {
    let force = channels.only_force("a hammer test")?;
    let rate = channels.recording.sample_rate_hz;
    let refused = |what: String| FrfError::Content {
        path: channels.recording.path.clone(),
        what,
    };
    let rest = Rest::of(&force.samples);
    let impacts = impacts(&force.samples, rest, rate);
    if impacts.is_empty() {
        return Err(refused(format!(
            "{} has no impact of a hammer: no pulse stands out of the noise",
            force.name
        )));
    }
    let samples = force.samples.len();
    let longest = longest_segment(&impacts, samples);
    let length = match windows.segment_s {
        Some(seconds) => (seconds * rate).round() as usize,
        None => longest,
    } & !1;
    let before = (BEFORE * length as f64) as usize;
    let has_segment =
        |impact: &MeasuredImpact| impact.first >= before && impact.first - before + length <= samples;
    let (impacts, cut_short): (Vec<_>, Vec<_>) = impacts.into_iter().partition(has_segment);
    if length < 16 || impacts.is_empty() {
        return Err(refused(format!(
            "no impact has {:.3} s of record after it; the impacts are {:.3} s apart at least",
            length as f64 / rate,
            longest as f64 / rate
        )));
    }
    let clipping = Clipping::of(channels);
    let is_clipped = |impact: &MeasuredImpact| {
        let start = impact.first - before;
        clipping.holds(start..start + length)
    };
    let (clipped, mut impacts): (Vec<_>, Vec<_>) = impacts.into_iter().partition(is_clipped);
    if impacts.is_empty() {
        return Err(refused(format!(
            "{}, in all {} impacts; strike softer, or take a larger range of the sensor",
            clipping.names(),
            clipped.len()
        )));
    }
    for impact in &mut impacts {
        impact.second = second_pulse(&force.samples, rest, impact, impact.first - before + length, rate);
    }
    let (double, used): (Vec<MeasuredImpact>, Vec<MeasuredImpact>) =
        impacts.into_iter().partition(|impact| impact.second.is_some());
    let Some(first) = used.first() else {
        let (delay_s, part) = double[0].second.unwrap_or_default();
        return Err(refused(format!(
            "all {} impacts are double (after the first at {:.3} s a second pulse of {:.0} % of its force follows {:.1} ms later); strike again so that \
             the hammer touches once, or end the segments before the second pulse by --resolution-hz above {:.0}",
            double.len(),
            double[0].time_s,
            100.0 * part,
            1e3 * delay_s,
            1.0 / delay_s
        )));
    };
    debug_assert!(first.last >= first.first);
    let mut cut = ImpactSegments {
        signals: channels
            .signals()
            .iter()
            .map(|_| Vec::with_capacity(used.len() * length))
            .collect(),
        length,
        end_amplitude: 0.0,
        used: Vec::new(),
        double,
        cut_short,
        clipped,
    };
    for impact in used {
        let start = impact.first - before;
        for (index, signal) in channels.signals().into_iter().enumerate() {
            let segment = &signal[start..start + length];
            let is_force = index == 0;
            let offset = segment[..before].iter().sum::<f64>() / before.max(1) as f64;
            let windowed = segment.iter().enumerate().map(|(k, sample)| {
                let force_window = if is_force {
                    pulse_weight(&impact, start + k)
                } else {
                    1.0
                };
                let since_s = (k as f64 - before as f64).max(0.0) / rate;
                let decay = windows.exponential_s.map_or(1.0, |tau| (-since_s / tau).exp());
                (sample - offset) * force_window * decay
            });
            cut.signals[index].extend(windowed);
            if !is_force {
                let at = cut.signals[index].len() - length;
                cut.end_amplitude = cut.end_amplitude.max(end_amplitude(&cut.signals[index][at..]));
            }
        }
        cut.used.push(impact);
    }
    Ok(cut)
}

/// True if a force is that of a hammer: it has impacts, their peaks have one sign, and their pulses take up at most the
/// share [`STRUCK_SHARE`] of the samples and at least the share [`STRUCK_ENERGY`] of the energy.
pub(super) fn is_struck(force: &[f64], rate: f64) -> bool {
    let rest = Rest::of(force);
    let impacts = impacts(force, rest, rate);
    // A strike soon after another counts as its bounce, but is a pulse of the hammer too.
    let pulses = pulses(force, rest, rate);
    let middle = rest.middle;
    let energy = |samples: &[f64]| -> f64 { samples.iter().map(|f| (f - middle).powi(2)).sum() };
    let samples: usize = pulses.iter().map(|pulse| pulse.last - pulse.first + 1).sum();
    let struck: f64 = pulses
        .iter()
        .map(|pulse| energy(&force[pulse.first..=pulse.last]))
        .sum();
    let has_one_sign = impacts
        .windows(2)
        .all(|pair| pair[0].peak_n * pair[1].peak_n > 0.0);
    !impacts.is_empty()
        && has_one_sign
        && samples as f64 <= STRUCK_SHARE * force.len() as f64
        && struck >= STRUCK_ENERGY * energy(force)
}

/// Amplitude (√2 · RMS) of the last twentieth of a segment of a response, as a fraction of the largest magnitude in the
/// segment; 0 for a segment of zeros.
fn end_amplitude(segment: &[f64]) -> f64 {
    let tail = &segment[segment.len() - segment.len() / 20..];
    let power = tail.iter().map(|x| x * x).sum::<f64>() / tail.len().max(1) as f64;
    let peak = segment.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    if peak > 0.0 {
        (2.0 * power).sqrt() / peak
    } else {
        0.0
    }
}

/// Weight of the force window at a sample: 1 over the force pulse and one pulse width after it, with half-cosine tapers
/// to 0 before and after, each one pulse width long. The pulse width counts as at least four samples. Outside the
/// contact the force signal is noise only.
fn pulse_weight(impact: &MeasuredImpact, sample: usize) -> f64 {
    let width = (impact.last - impact.first).max(4);
    let outside = if sample < impact.first {
        impact.first - sample
    } else {
        sample.saturating_sub(impact.last + width)
    };
    if outside >= width {
        0.0
    } else {
        0.5 + 0.5 * (std::f64::consts::PI * outside as f64 / width as f64).cos()
    }
}

/// Greatest length, in samples, of segments of equal length, one per impact, that neither overlap nor exceed the end of
/// the record.
fn longest_segment(impacts: &[MeasuredImpact], samples: usize) -> usize {
    let ends = impacts.iter().skip(1).map(|impact| impact.first).chain([samples]);
    let shortest = impacts
        .iter()
        .zip(ends)
        .map(|(impact, end)| end - impact.first)
        .min()
        .unwrap_or(0);
    // The segment of an impact also includes the fraction `BEFORE` of its length before the impact.
    (shortest as f64 / (1.0 + BEFORE)) as usize
}

/// Detects the impacts of a hammer in a force signal, in the order of time. Pulses that start within [`BOUNCE_S`] after
/// the start of an impact are its bounces and do not count.
fn impacts(force: &[f64], rest: Rest, rate: f64) -> Vec<MeasuredImpact> {
    let mut impacts: Vec<MeasuredImpact> = Vec::new();
    for pulse in pulses(force, rest, rate) {
        let follows = impacts
            .last()
            .is_some_and(|before| ((pulse.first - before.first) as f64) < BOUNCE_S * rate);
        if !follows {
            impacts.push(pulse);
        }
    }
    impacts
}

/// Detects all pulses in a force signal, bounces included, in the order of time.
fn pulses(force: &[f64], Rest { middle, noise }: Rest, rate: f64) -> Vec<MeasuredImpact> {
    let largest = force
        .iter()
        .fold(0.0_f64, |largest, f| largest.max((f - middle).abs()));
    let threshold = (LEAST_IMPACT * largest).max(PULSE_ABOVE_NOISE * noise);
    let mut pulses: Vec<MeasuredImpact> = Vec::new();
    let mut k = 0;
    while k < force.len() {
        if (force[k] - middle).abs() <= threshold {
            k += 1;
            continue;
        }
        let foot = (PULSE_END * threshold).max(PULSE_END_ABOVE_NOISE * noise);
        let above = |k: usize| (force[k] - middle).abs() > foot;
        let mut first = k;
        while first > 0 && above(first - 1) {
            first -= 1;
        }
        let mut last = k;
        while last + 1 < force.len() && above(last + 1) {
            last += 1;
        }
        let peak = (first..=last)
            .max_by(|&a, &b| (force[a] - middle).abs().total_cmp(&(force[b] - middle).abs()))
            .unwrap_or(k);
        pulses.push(MeasuredImpact {
            time_s: peak as f64 / rate,
            peak_n: force[peak] - middle,
            second: None,
            first,
            last,
        });
        k = last + 1;
    }
    pulses
}

/// Magnitudes of the peaks of the impacts in a force signal, N, in the order of time.
pub(super) fn force_peaks(force: &[f64], rate: f64) -> Vec<f64> {
    let impacts = impacts(force, Rest::of(force), rate);
    impacts.iter().map(|impact| impact.peak_n.abs()).collect()
}

/// True if a signal that is taken for the force of a hammer has impacts, and each of them is double (`is_double`) or each
/// is single: a second pulse follows before the next impact, or none does.
pub(super) fn all_impacts_are(is_double: bool, force: &[f64], rate: f64) -> bool {
    let rest = Rest::of(force);
    let impacts = impacts(force, rest, rate);
    let ends = impacts.iter().skip(1).map(|next| next.first).chain([force.len()]);
    !impacts.is_empty()
        && impacts
            .iter()
            .zip(ends)
            .all(|(impact, end)| second_pulse(force, rest, impact, end, rate).is_some() == is_double)
}

/// Second force pulse of an impact: the largest force from one pulse width after the pulse of the impact to before
/// sample `end`. Delay after the peak of the impact, s, and magnitude as a fraction of that peak. `None` if the force
/// does not exceed the threshold of a double impact, or if no sample is left.
fn second_pulse(
    force: &[f64],
    Rest { middle, noise }: Rest,
    impact: &MeasuredImpact,
    end: usize,
    rate: f64,
) -> Option<(f64, f64)> {
    let width = (impact.last - impact.first).max(4);
    // One pulse width after the first pulse (at least four samples) is skipped, since anti-aliasing filters ring there.
    let from = (impact.last + width).min(end);
    let (at, size) = (from..end.min(force.len()))
        .map(|k| (k, (force[k] - middle).abs()))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let threshold = (SECOND_PULSE * impact.peak_n.abs()).max(PULSE_ABOVE_NOISE * noise);
    let delay_s = at as f64 / rate - impact.time_s;
    (size > threshold).then(|| (delay_s, size / impact.peak_n.abs()))
}

/// Force of a hammer between its impacts, N. Rare impacts do not affect medians.
#[derive(Clone, Copy)]
struct Rest {
    /// Median force of the record.
    middle: f64,
    /// Standard deviation of the noise: 1.4826 times the median absolute deviation from the middle, which holds for
    /// Gaussian noise.
    noise: f64,
}

impl Rest {
    fn of(force: &[f64]) -> Self {
        let middle = median(&mut force.to_vec()).unwrap_or(0.0);
        let mut deviations: Vec<f64> = force.iter().map(|f| (f - middle).abs()).collect();
        Self {
            middle,
            noise: 1.4826 * median(&mut deviations).unwrap_or(0.0),
        }
    }
}
