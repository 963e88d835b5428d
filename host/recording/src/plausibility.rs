//! Plausibility of units: peak values that no sensor measures, and displacement, velocity and acceleration of one
//! direction that contradict each other by a unit factor such as 1000.

use super::blocks::{rises, wheel};
use super::criteria::{FASTEST_SPINDLE_RPM, SAME_MOTION, UNIT_FACTOR, plausible_peak};
use super::{Channel, Quantity, Recording};

/// Factors by which the unit of a channel is often wrong: g instead of m/s², milli, micro.
const FACTORS: [(f64, &str); 3] = [(9.806_65, "9.81 (g and m/s²)"), (1e3, "1000"), (1e6, "a million")];

/// Warnings about channels whose unit is probably wrong; empty if there is none.
pub(super) fn warnings(recording: &Recording) -> Vec<String> {
    let mut warnings: Vec<String> = recording.channels.iter().filter_map(peak).collect();
    warnings.extend(fast_tachometer(recording));
    for axis in ["x", "y", "z"] {
        let of = |prefix: &str, quantity: Quantity| {
            recording
                .channel(&format!("{prefix}{axis}"))
                .filter(|channel| channel.quantity == quantity)
        };
        let displacement = of("", Quantity::Displacement);
        let velocity = of("v", Quantity::Velocity);
        let acceleration = of("a", Quantity::Acceleration);
        for (lower, order, upper) in [
            (displacement, 2, acceleration),
            (velocity, 1, acceleration),
            (displacement, 1, velocity),
        ] {
            if let (Some(lower), Some(upper)) = (lower, upper) {
                warnings.extend(contradiction(lower, order, upper, recording.sample_rate_hz));
            }
        }
    }
    warnings
}

/// Warning for a tachometer whose pulses, by the marks that the sidecar states, give a spindle speed that few spindles
/// reach: the wheel has probably more marks. `None` for slower or missing ones.
fn fast_tachometer(recording: &Recording) -> Option<String> {
    let wheel = wheel(recording)?;
    let level = recording.channel("tacho")?.samples.as_slice();
    let samples: Vec<usize> = rises(level).map(|rise| rise.sample).collect();
    let mut steps: Vec<usize> = samples.windows(2).map(|pair| pair[1] - pair[0]).collect();
    steps.sort_unstable();
    let usual = *steps.get(steps.len() / 2).filter(|step| **step > 0)?;
    let rpm = 60.0 * recording.sample_rate_hz / (usual as f64 * f64::from(wheel.positions.max(1)));
    (rpm > FASTEST_SPINDLE_RPM).then(|| {
        format!(
            "the pulses of tacho are those of {rpm:.0} rev/min at {} marks per revolution: if the wheel has more, state pulses_per_rev under \
             [channels.tacho] in the sidecar",
            wheel.positions
        )
    })
}

/// Warning for a channel whose peak value lies outside the range that sensors measure; `None` for other channels.
fn peak(channel: &Channel) -> Option<String> {
    let (low, high) = plausible_peak(channel.quantity)?;
    let peak = channel
        .samples
        .iter()
        .fold(0.0_f64, |largest, sample| largest.max(sample.abs()));
    let unit = channel.quantity.unit();
    let bound = if peak > high {
        format!("above {high:e} {unit}")
    } else if peak > 0.0 && peak < low {
        format!("below {low:e} {unit}")
    } else {
        return None;
    };
    Some(format!(
        "the peak of {} is {peak:.3e} {unit}, {bound}: check its unit (--map COLUMN={}:UNIT states another one)",
        channel.name, channel.name
    ))
}

/// Warning if the time derivative of order `order` of motion `lower` agrees with motion `upper` except for one of the
/// unit factors [`FACTORS`]; `None` otherwise.
///
/// If `upper` is that derivative, differences of `lower` over a time 2T equal weighted integrals of `upper`: for order
/// 2, x(t+T) − 2x(t) + x(t−T) = ∫ (T − |s|) a(t+s) ds from s = −T to T. Sums over the samples approximate the
/// integrals. The longer T, the less the noise of `lower` is amplified; the T from 1 to 64 sample intervals, in powers
/// of two, with the best correlation counts.
fn contradiction(lower: &Channel, order: u32, upper: &Channel, rate_hz: f64) -> Option<String> {
    let mut best: Option<(f64, f64)> = None;
    let mut half = 1;
    while half <= 64 && 4 * half < lower.samples.len() {
        if let Some((correlation, ratio)) = compared(&lower.samples, order, &upper.samples, half, rate_hz)
            && best.is_none_or(|(before, _)| correlation > before)
        {
            best = Some((correlation, ratio));
        }
        half *= 2;
    }
    let (correlation, ratio) = best?;
    if correlation < 1.0 - SAME_MOTION {
        return None;
    }
    FACTORS.iter().find_map(|(factor, words)| {
        let is_near = |ratio: f64| (ratio / factor - 1.0).abs() < UNIT_FACTOR;
        let (small, large) = if is_near(ratio) {
            (&upper.name, &lower.name)
        } else if is_near(1.0 / ratio) {
            (&lower.name, &upper.name)
        } else {
            return None;
        };
        Some(format!(
            "{} and {} are the same motion, but {large} is larger than {small} allows by a factor of {words}: the unit of one of them is wrong",
            lower.name, upper.name
        ))
    })
}

/// Correlation of differences of `lower` over 2·`half` samples with the weighted sums of `upper` that approximate them,
/// and ratio of their standard deviations (differences to sums); `None` for up to 8 differences, or if the differences
/// or the sums are all equal.
fn compared(lower: &[f64], order: u32, upper: &[f64], half: usize, rate_hz: f64) -> Option<(f64, f64)> {
    let count = lower.len().min(upper.len());
    let step = 1.0 / rate_hz;
    // With cumulated sums of `upper`, each of its partial sums is one subtraction.
    let mut first = vec![0.0; count + 1];
    for (index, value) in upper.iter().take(count).enumerate() {
        first[index + 1] = first[index] + value;
    }
    let sum = |from: usize, to: usize| first[to] - first[from];
    let mut pairs = Vec::with_capacity(count);
    // One difference every `half` samples suffices, since those in between differ little.
    for center in (half..count.saturating_sub(half)).step_by(half) {
        let (difference, integral) = if order == 2 {
            let difference = lower[center + half] - 2.0 * lower[center] + lower[center - half];
            let weighted: f64 = (1..half)
                .map(|offset| sum(center - (half - offset), center + (half - offset) + 1))
                .sum::<f64>()
                + upper[center];
            (difference, weighted * step * step)
        } else {
            let difference = lower[center + half] - lower[center - half];
            let ends = 0.5 * (upper[center - half] + upper[center + half]);
            (difference, (sum(center - half + 1, center + half) + ends) * step)
        };
        pairs.push((difference, integral));
    }
    let mean = |of: fn(&(f64, f64)) -> f64| pairs.iter().map(of).sum::<f64>() / pairs.len().max(1) as f64;
    let (a, b) = (mean(|pair| pair.0), mean(|pair| pair.1));
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (difference, integral) in &pairs {
        aa += (difference - a).powi(2);
        bb += (integral - b).powi(2);
        ab += (difference - a) * (integral - b);
    }
    (pairs.len() > 8 && aa > 0.0 && bb > 0.0).then(|| (ab / (aa * bb).sqrt(), (aa / bb).sqrt()))
}

#[cfg(test)]
mod tests {
    use super::super::Sidecar;
    use super::*;

    fn recording(factor: f64) -> Recording {
        let omega = 2.0 * std::f64::consts::PI * 40.0;
        let time = |k: u32| f64::from(k) / 2000.0;
        let channel = |name: &str, quantity, of: &dyn Fn(f64) -> f64| Channel {
            name: name.into(),
            quantity,
            samples: (0..2000).map(|k| of(time(k))).collect(),
        };
        Recording {
            path: "a.csv".into(),
            sample_rate_hz: 2000.0,
            start_s: 0.0,
            since_s: 0.0,
            channels: vec![
                channel("x", Quantity::Displacement, &|t| 1e-5 * (omega * t).sin()),
                channel("ax", Quantity::Acceleration, &|t| {
                    -factor * omega * omega * 1e-5 * (omega * t).sin()
                }),
            ],
            sidecar: Sidecar::default(),
        }
    }

    #[test]
    fn a_unit_that_is_wrong_by_gravity_or_a_thousand_is_found() {
        assert_eq!(warnings(&recording(1.0)), Vec::<String>::new());
        for (factor, words) in [
            (1.0 / 9.806_65, "9.81"),
            (9.806_65, "9.81"),
            (1e-3, "1000"),
            (1e3, "1000"),
        ] {
            let found = warnings(&recording(factor));
            assert!(
                found.len() == 1 && found[0].contains(words),
                "{factor}: {found:?}"
            );
        }
        // A sensor at another place sees another amplitude.
        assert_eq!(warnings(&recording(0.7)), Vec::<String>::new());
    }

    #[test]
    fn a_peak_that_no_sensor_measures_is_found() {
        let found = warnings(&recording(1e6));
        assert!(
            found
                .iter()
                .any(|words| words.contains("check its unit") || words.contains("million")),
            "{found:?}"
        );
    }
}
