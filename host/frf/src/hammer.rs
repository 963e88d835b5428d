//! Blows of a hammer: where they are, which of them are double, and the windows for force and response.

use super::FrfError;
use super::driven::Driven;

/// A second pulse within this time is a bounce: nobody strikes twice so fast on purpose.
const BOUNCE_S: f64 = 0.4;

/// Part of the largest force that a pulse must reach to be a blow.
const BLOW: f64 = 0.1;

/// Part of a blow's own peak that a second pulse must reach to count; ringing of filters stays below it.
const SECOND: f64 = 0.03;

/// Standard deviations of the noise that any pulse must reach.
const NOISE: f64 = 8.0;

/// Part of a segment before the blow.
const BEFORE: f64 = 0.01;

/// A blow.
#[derive(Clone, Debug, PartialEq)]
pub struct Blow {
    /// Time of its peak, s.
    pub time_s: f64,
    /// Its largest force, N, with its sign.
    pub peak_n: f64,
    /// Delay and size, as a part of the peak, of the largest second pulse that falls into its segment.
    pub second: Option<(f64, f64)>,
    /// First and last sample of the pulse, and the peak.
    first: usize,
    last: usize,
}

/// How blows become segments.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct HammerWindows {
    /// Length of a segment, s; as long as the blows allow where it is not given.
    pub segment_s: Option<f64>,
    /// Time constant of the exponential window on force and response, s; none where it is not given.
    ///
    /// With e^{−t/τ} on both, the FRF is exactly H(iω + 1/τ): every pole λ moves to λ − 1/τ. See [`true_damping`].
    pub exponential_s: Option<f64>,
}

/// The damping ratio of a mode, from that of an FRF with an exponential window of time constant τ.
///
/// The window moves the pole λ = −ζω ± iω√(1 − ζ²) by −1/τ. Its imaginary part stays, so with λ' = λ_measured + 1/τ
/// the natural frequency is |λ'| and ζ = −Re λ'/|λ'|. Returns natural frequency in Hz and ζ, which is negative where
/// the measured damping is less than the window's.
pub fn true_damping(frequency_hz: f64, damping_ratio: f64, exponential_s: f64) -> (f64, f64) {
    let decay_hz = frequency_hz * damping_ratio - 1.0 / (std::f64::consts::TAU * exponential_s);
    let damped_hz = frequency_hz * (1.0 - damping_ratio * damping_ratio).max(0.0).sqrt();
    let true_hz = decay_hz.hypot(damped_hz);
    (true_hz, decay_hz / true_hz)
}

/// What blows were cut into.
pub(super) struct BlowSegments {
    /// Forces and responses after their windows, each segment behind the other.
    pub(super) signals: Vec<Vec<f64>>,
    /// Samples of a segment.
    pub(super) length: usize,
    /// The blows that are in it.
    pub(super) used: Vec<Blow>,
    /// Those that are not: double.
    pub(super) double: Vec<Blow>,
    /// The largest part of a response's peak, root mean square, with which a segment ends.
    pub(super) left_over: f64,
}

/// Cuts the blows of a record, which double ones are left out of.
///
/// # Errors
/// Several forces, no blow, only double ones, segments that are longer than the record.
pub(super) fn segments(driven: &Driven<'_>, windows: HammerWindows) -> Result<BlowSegments, FrfError> {
    let force = driven.only_force("a hammer test")?;
    let rate = driven.recording.sample_rate_hz;
    let refused = |what: String| FrfError::Content {
        path: driven.recording.path.clone(),
        what,
    };
    let mut blows = blows(&force.samples, rate);
    if blows.is_empty() {
        return Err(refused(format!(
            "{} has no blow of a hammer: no pulse stands out of the noise",
            force.name
        )));
    }
    let samples = force.samples.len();
    let longest = longest_segment(&blows, samples);
    let length = match windows.segment_s {
        Some(seconds) => (seconds * rate).round() as usize,
        None => longest,
    } & !1;
    let before = (BEFORE * length as f64) as usize;
    blows.retain(|blow| blow.first >= before && blow.first - before + length <= samples);
    if length < 16 || blows.is_empty() {
        return Err(refused(format!(
            "no blow has {:.3} s of record after it; the blows are {:.3} s apart at least",
            length as f64 / rate,
            longest as f64 / rate
        )));
    }
    for blow in &mut blows {
        blow.second = second_pulse(&force.samples, blow, blow.first - before + length, rate);
    }
    let (double, used): (Vec<Blow>, Vec<Blow>) = blows.into_iter().partition(|blow| blow.second.is_some());
    let Some(first) = used.first() else {
        let (delay_s, part) = double[0].second.unwrap_or_default();
        return Err(refused(format!(
            "all {} blows are double (the first at {:.3} s has a second pulse of {:.0} % {:.1} ms later); strike again, or take shorter segments",
            double.len(),
            double[0].time_s,
            100.0 * part,
            1e3 * delay_s
        )));
    };
    debug_assert!(first.last >= first.first);
    let mut cut = BlowSegments {
        signals: driven
            .signals()
            .iter()
            .map(|_| Vec::with_capacity(used.len() * length))
            .collect(),
        length,
        left_over: 0.0,
        used: Vec::new(),
        double,
    };
    for blow in used {
        let start = blow.first - before;
        for (index, signal) in driven.signals().into_iter().enumerate() {
            let segment = &signal[start..start + length];
            let is_force = index == 0;
            let offset = segment[..before].iter().sum::<f64>() / before.max(1) as f64;
            let windowed = segment.iter().enumerate().map(|(k, sample)| {
                let force_window = if is_force {
                    pulse_weight(&blow, start + k)
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
                cut.left_over = cut.left_over.max(left_over(&cut.signals[index][at..]));
            }
        }
        cut.used.push(blow);
    }
    Ok(cut)
}

/// Root mean square of the last twentieth, as a part of the peak.
fn left_over(segment: &[f64]) -> f64 {
    let tail = &segment[segment.len() - segment.len() / 20..];
    let power = tail.iter().map(|x| x * x).sum::<f64>() / tail.len().max(1) as f64;
    let peak = segment.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
    if peak > 0.0 {
        (2.0 * power).sqrt() / peak
    } else {
        0.0
    }
}

/// 1 over the pulse and its own width behind it, half a cosine to 0 after that: the force of a hammer that has left is
/// nothing but noise.
fn pulse_weight(blow: &Blow, sample: usize) -> f64 {
    let width = (blow.last - blow.first).max(4);
    let outside = if sample < blow.first {
        blow.first - sample
    } else {
        sample.saturating_sub(blow.last + width)
    };
    if outside >= width {
        0.0
    } else {
        0.5 + 0.5 * (std::f64::consts::PI * outside as f64 / width as f64).cos()
    }
}

/// The most samples that each blow has to itself.
fn longest_segment(blows: &[Blow], samples: usize) -> usize {
    let ends = blows.iter().skip(1).map(|blow| blow.first).chain([samples]);
    let shortest = blows
        .iter()
        .zip(ends)
        .map(|(blow, end)| end - blow.first)
        .min()
        .unwrap_or(0);
    // Each has its part before as well.
    (shortest as f64 / (1.0 + BEFORE)) as usize
}

/// All blows of a force signal; pulses that follow a blow within a bounce belong to it.
fn blows(force: &[f64], rate: f64) -> Vec<Blow> {
    let middle = median(force.to_vec());
    let noise = noise(force, middle);
    let largest = force
        .iter()
        .fold(0.0_f64, |largest, f| largest.max((f - middle).abs()));
    let threshold = (BLOW * largest).max(NOISE * noise);
    let mut blows: Vec<Blow> = Vec::new();
    let mut k = 0;
    while k < force.len() {
        if (force[k] - middle).abs() <= threshold {
            k += 1;
            continue;
        }
        let foot = (0.05 * threshold).max(2.0 * noise);
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
        let follows = blows
            .last()
            .is_some_and(|before| ((first - before.first) as f64) < BOUNCE_S * rate);
        if !follows {
            blows.push(Blow {
                time_s: peak as f64 / rate,
                peak_n: force[peak] - middle,
                second: None,
                first,
                last,
            });
        }
        k = last + 1;
    }
    blows
}

/// The largest second pulse before sample `end`: its delay in s, and its part of the peak.
fn second_pulse(force: &[f64], blow: &Blow, end: usize, rate: f64) -> Option<(f64, f64)> {
    let middle = median(force.to_vec());
    let width = (blow.last - blow.first).max(4);
    // What rings of filters is next to the pulse.
    let from = (blow.last + width).min(end);
    let (at, size) = (from..end.min(force.len()))
        .map(|k| (k, (force[k] - middle).abs()))
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    let threshold = (SECOND * blow.peak_n.abs()).max(NOISE * noise(force, middle));
    let delay_s = at as f64 / rate - blow.time_s;
    (size > threshold).then(|| (delay_s, size / blow.peak_n.abs()))
}

/// Standard deviation of normal noise, from the median of its absolute values: blows are rare.
fn noise(force: &[f64], middle: f64) -> f64 {
    1.4826 * median(force.iter().map(|f| (f - middle).abs()).collect())
}

fn median(mut values: Vec<f64>) -> f64 {
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}
