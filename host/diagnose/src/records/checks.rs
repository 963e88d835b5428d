//! Refuses recordings that cannot be compared, with a message that says what is required.

use crate::baseline::{Baseline, pickup_of};
use crate::criteria::{
    CLIPPED_IMPACT_SAMPLES, CLIPPED_IMPACT_STEP, CLIPPED_SHARE, FRICTION_RATIO, GAIN_UNIT_TOLERANCE,
    IMPOSSIBLE_RATIO, LEAST_CORRELATION_OF_KNOWN_UNIT, LEAST_CORRELATION_OF_UNKNOWN_UNIT,
    LEAST_ENERGY_OVER_FORCE_NOISE, LEAST_PERIODS, LEAST_SAMPLES, POUND_TOLERANCE, SPEED_AS_STATED,
    UNIT_TOLERANCE, WRONG_UNIT_RATIO,
};
use crate::error::DiagnoseError;
use crate::motion::recorded_cut::check_sidecar;
use crate::motion::spindle_motion::SpindleMotion;
use crate::records::channel::Observed;
use crate::records::pulses;
use crate::signal::noise::rms;
use quietcut_model::case::Case;
use quietcut_recording::Recording;

/// Refuses a recording with a channel that is not finite, or clipped where it measures the machine.
pub(crate) fn signals(recording: &Recording) -> Result<(), DiagnoseError> {
    let wrong = |what: String| Err(DiagnoseError::record(&recording.path, what));
    for channel in &recording.channels {
        if let Some(at) = channel.samples.iter().position(|sample| !sample.is_finite()) {
            return wrong(format!(
                "{} is not a finite number at {:.6} s; every sample must be finite",
                channel.name,
                recording.time_s(at)
            ));
        }
        if pickup_of(&channel.name).is_some()
            && let Some(level) = clipped(&channel.samples)
        {
            return wrong(format!(
                "{} is clipped at {level:.6e} {}: the range of the sensor is too small; record again with a larger range or less excitation",
                channel.name,
                channel.quantity.unit()
            ));
        }
    }
    Ok(())
}

/// Refuses a recorded cut whose sidecar contradicts the teeth of the case or the speed of the tachometer, or whose
/// tachometer has wrong pulses.
pub(crate) fn cut(case: &Case, recording: &Recording) -> Result<(), DiagnoseError> {
    pulses::check(recording)?;
    // A recording without a usable tachometer is refused when it is prepared.
    SpindleMotion::new(recording, None).map_or(Ok(()), |motion| check_sidecar(case, recording, motion.rpm()))
}

/// A remark on a recorded cut whose tachometer gives another speed than its sidecar states, by more than
/// [`SPEED_AS_STATED`].
pub(crate) fn speed_remark(recording: &Recording) -> Option<String> {
    let stated_rpm = recording.sidecar.cut?.spindle_rpm?;
    let rpm = SpindleMotion::new(recording, None).ok()?.rpm();
    ((rpm / stated_rpm - 1.0).abs() > SPEED_AS_STATED).then(|| {
        format!(
            "{}: the tachometer gives {rpm:.1} rev/min, the sidecar {stated_rpm}: either the spindle slips or the sample \
             clock is off, and with the clock all frequencies; a mass or stiffness of the whole machine may then be none",
            recording.path.display()
        )
    })
}

/// Refuses a recording that is too short or without a channel to compare, or has a channel that is zero throughout.
pub(crate) fn record(
    baseline: &Baseline<'_>,
    recording: &Recording,
    channels: &[Observed],
) -> Result<(), DiagnoseError> {
    let wrong = |what: String| Err(DiagnoseError::record(&recording.path, what));
    let count = recording.len();
    let seconds = count as f64 / recording.sample_rate_hz;
    if channels.is_empty() {
        let directions: Vec<String> = baseline
            .structure
            .directions
            .iter()
            .map(ToString::to_string)
            .collect();
        return wrong(format!(
            "no channel lies in a direction of the case ({}): a channel such as x, vx or ax is required",
            directions.join(", ")
        ));
    }
    let needed_s = baseline.lowest_hz().map_or(0.0, |hertz| LEAST_PERIODS / hertz);
    if count < LEAST_SAMPLES || seconds < needed_s {
        return wrong(format!(
            "too short: {count} samples, {seconds:.3} s; at least {LEAST_SAMPLES} samples and {needed_s:.3} s ({LEAST_PERIODS} periods of the slowest mode) are required"
        ));
    }
    if let Some(still) = channels.iter().find(|channel| rms(&channel.measured) == 0.0) {
        return wrong(format!(
            "{} is zero throughout: nothing was measured",
            still.pickup.name
        ));
    }
    Ok(())
}

/// A mix-up of two units.
struct UnitMixUp {
    /// Ratio of the two units, above 1.
    ratio: f64,
    /// Tolerance of the ratio, as a difference of logarithms.
    tolerance: f64,
    /// Words for it where a channel is larger than predicted by the ratio.
    larger: &'static str,
    /// Words for it where a channel is smaller than predicted by the ratio.
    smaller: &'static str,
}

/// The mix-up of two units whose words do not depend on which of them was read for the other.
const fn mix_up(ratio: f64, tolerance: f64, words: &'static str) -> UnitMixUp {
    UnitMixUp {
        ratio,
        tolerance,
        larger: words,
        smaller: words,
    }
}

const UNITS: [UnitMixUp; 6] = [
    mix_up(4.448, POUND_TOLERANCE, "the ratio of pounds of force and N"),
    mix_up(
        1e3,
        UNIT_TOLERANCE,
        "a thousand, as of mm and m, N and kN, or g and kg",
    ),
    mix_up(1e6, UNIT_TOLERANCE, "a million, as of µm and m"),
    mix_up(25.4, UNIT_TOLERANCE, "25.4, as of mm and inches"),
    mix_up(39.37, UNIT_TOLERANCE, "39.37, as of inches and m"),
    UnitMixUp {
        ratio: 9.806_65,
        tolerance: UNIT_TOLERANCE,
        larger: "9.81, as if numbers in m/s² were read as g",
        smaller: "1/9.81, as if numbers in g were read as m/s²",
    },
];

/// Refuses a channel whose ratio to the prediction is outside the range from `FRICTION_RATIO` to `WRONG_UNIT_RATIO` at
/// the same waveform, or impossible ([`far_off`]).
///
/// `response` is the response to the forces alone that the baseline predicts, `measured` the samples of the channel,
/// `by_noise` the energy of the channel's response to force-sensor noise. The ratio is the absolute least-squares
/// factor from `response` to `measured`. Nothing is refused if the energy of `response` is not well above `by_noise`.
pub(crate) fn unit(
    path: &std::path::Path,
    name: &str,
    response: &[f64],
    measured: &[f64],
    by_noise: f64,
) -> Result<(), DiagnoseError> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (own, cross) = (dot(response, response), dot(response, measured));
    let whole = dot(measured, measured);
    if own <= LEAST_ENERGY_OVER_FORCE_NOISE * by_noise || whole <= 0.0 {
        return Ok(());
    }
    // An impossible ratio is refused only if the varying part of the predicted response exceeds the response to force
    // noise: the response to a constant force says nothing about the vibration.
    if spread(response).powi(2) * response.len() as f64 > LEAST_ENERGY_OVER_FORCE_NOISE * by_noise {
        far_off(path, name, response, measured)?;
    }
    let factor = cross.abs() / own;
    let alike = cross * cross / (own * whole);
    let likely = likely(factor);
    // A wrong unit is reported only at a high correlation of measured and predicted samples, higher if their ratio
    // belongs to no known unit.
    let least_alike = if likely.is_some() {
        LEAST_CORRELATION_OF_KNOWN_UNIT
    } else {
        LEAST_CORRELATION_OF_UNKNOWN_UNIT
    };
    if alike < least_alike || (FRICTION_RATIO..WRONG_UNIT_RATIO).contains(&factor) {
        return Ok(());
    }
    Err(DiagnoseError::record(
        path,
        format!(
            "{name} is {} times the prediction of the case, with the same waveform: its unit, that of the force, or the case is wrong; give units in the header as name [unit].{}",
            digits(factor, 4),
            said(likely)
        ),
    ))
}

/// Refuses a channel of a hammer test that follows the prediction of the case with the opposite sign.
///
/// `response` and `measured` are as in [`unit`]. An impact begins a response with the sign of its force, whatever mass,
/// stiffness and damping are: another structure has another waveform, not the same one inverted. Of steady tones this
/// does not hold, since a resonance turns their phase.
pub(crate) fn sign(
    path: &std::path::Path,
    name: &str,
    response: &[f64],
    measured: &[f64],
) -> Result<(), DiagnoseError> {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let correlation = dot(response, measured) / (dot(response, response) * dot(measured, measured)).sqrt();
    if correlation.is_nan() || correlation > -LEAST_CORRELATION_OF_UNKNOWN_UNIT.sqrt() {
        return Ok(());
    }
    Err(DiagnoseError::record(
        path,
        format!(
            "{name} answers the impacts with the opposite sign of the prediction (correlation {correlation:.2}): the \
             sensor, the hammer or the sign in the file is inverted"
        ),
    ))
}

/// Result of the unit checks of a cut: success if one channel passes or none is checked, otherwise the first refusal.
/// If one unit is right, a ratio of another channel within the limits of [`far_off`] is not a wrong unit: a wrong edge
/// coefficient alone may change a small axial force by a factor of ten.
pub(crate) fn unless_one_is_right(
    checked: impl IntoIterator<Item = Result<(), DiagnoseError>>,
) -> Result<(), DiagnoseError> {
    let checked: Vec<_> = checked.into_iter().collect();
    if checked.iter().any(Result::is_ok) {
        return Ok(());
    }
    checked.into_iter().collect()
}

/// Refuses a channel whose amplitude differs from its prediction by a factor that no machine reaches, whatever its
/// waveform. Sensor offsets are removed. A channel is too large against the prediction including its mean, because
/// evenly pitched teeth in a slot give almost no variation; it is too small against the variation of the prediction.
pub(crate) fn far_off(
    path: &std::path::Path,
    name: &str,
    response: &[f64],
    measured: &[f64],
) -> Result<(), DiagnoseError> {
    let moves = spread(measured);
    let [least, most] = [moves / rms(response), moves / spread(response)];
    let factor = match () {
        () if least.is_finite() && least > IMPOSSIBLE_RATIO => least,
        () if most.is_finite() && moves > 0.0 && most < 1.0 / IMPOSSIBLE_RATIO => most,
        () => return Ok(()),
    };
    Err(DiagnoseError::record(
        path,
        format!(
            "{name} is {} times the prediction of the case, more than any machine differs from its model: its unit, that of its excitation, or the case is wrong; give units in the header as name [unit].{}",
            digits(factor, 2),
            said(likely(factor))
        ),
    ))
}

/// A positive number with at least this number of significant digits, and without an exponent.
fn digits(value: f64, significant: i32) -> String {
    let after_point = significant - 1 - value.abs().max(f64::MIN_POSITIVE).log10().floor() as i32;
    format!("{value:.*}", after_point.max(0) as usize)
}

/// Root mean square of the deviations of the samples from their mean.
fn spread(samples: &[f64]) -> f64 {
    let mean = samples.iter().sum::<f64>() / samples.len().max(1) as f64;
    rms(&samples.iter().map(|x| x - mean).collect::<Vec<_>>())
}

/// Words for the mix-up of units (such as g and m/s²) that a fitted sensor gain may stand for; `None` if the gain is
/// near the ratio of no such mix-up.
pub(crate) fn unit_of_gain(gain: f64) -> Option<&'static str> {
    unit_within(gain.abs(), |_| GAIN_UNIT_TOLERANCE)
}

/// Words for the unit mix-up that probably made a channel larger or smaller than predicted by `factor`; `None` if no
/// known one has this ratio.
fn likely(factor: f64) -> Option<&'static str> {
    unit_within(factor, |share| share)
}

fn unit_within(factor: f64, most: impl Fn(f64) -> f64) -> Option<&'static str> {
    let size = factor.max(1.0 / factor);
    let near = |mix_up: &UnitMixUp| (size / mix_up.ratio).ln().abs();
    let known = UNITS
        .iter()
        .filter(|mix_up| near(mix_up) < most(mix_up.tolerance));
    let nearest = known.min_by(|a, b| near(a).total_cmp(&near(b)))?;
    Some(if factor > 1.0 {
        nearest.larger
    } else {
        nearest.smaller
    })
}

fn said(likely: Option<&str>) -> String {
    likely.map_or_else(String::new, |meant| format!(" It is about {meant}."))
}

/// The level at which a channel is clipped: at one end of its range, unless that is zero, it has at least two flat tops
/// of at least three equal samples with more than the share `CLIPPED_SHARE` of all samples, or one as short as that of
/// an impact, with steep flanks. `None` without clipping.
fn clipped(samples: &[f64]) -> Option<f64> {
    let (low, high) = samples
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| {
            (low.min(*x), high.max(*x))
        });
    let range = high - low;
    if range <= 0.0 {
        return None;
    }
    let resolution = samples
        .windows(2)
        .map(|pair| (pair[1] - pair[0]).abs())
        .filter(|step| *step > 1e-9 * range)
        .fold(f64::INFINITY, f64::min);
    // A digital signal has few levels and may be zero for long: flat tops at zero are no clipping.
    [high, low].into_iter().find(|end| {
        let at = |x: &f64| (x - end).abs() <= 1e-9 * range;
        if *end != 0.0 && has_cliff(samples, at, *end, resolution) {
            return true;
        }
        let (mut flat, mut run, mut runs) = (0, 0, 0);
        for sample in samples {
            if at(sample) {
                run += 1;
                continue;
            }
            if run >= 3 {
                flat += run;
                runs += 1;
            }
            run = 0;
        }
        runs >= 2 && flat as f64 > CLIPPED_SHARE * samples.len() as f64 && *end != 0.0
    })
}

/// True if, at the end `end` of a channel's range, a flat top as short as that of an impact has a steep flank on both
/// sides. A smooth peak that is flat over three samples falls by at most ten levels two samples beside them: a parabola
/// that stays within one level over three samples has a curvature of c ≤ 1 level and falls by 9c up to there, and
/// rounding adds one level.
fn has_cliff(samples: &[f64], at: impl Fn(&f64) -> bool, end: f64, resolution: f64) -> bool {
    let (mut first, mut steepest) = (0, 0.0_f64);
    while first < samples.len() {
        if !at(&samples[first]) {
            first += 1;
            continue;
        }
        let length = samples[first..].iter().take_while(|x| at(x)).count();
        let beyond = first + length;
        let sides = [first.checked_sub(2), Some(beyond + 1)];
        if CLIPPED_IMPACT_SAMPLES.contains(&length)
            && let [Some(before), Some(after)] = sides.map(|place| Some(samples.get(place?)? - end))
        {
            steepest = steepest.max(before.abs().min(after.abs()));
        }
        first = beyond;
    }
    steepest > CLIPPED_IMPACT_STEP * resolution
        && steepest > CLIPPED_IMPACT_STEP * written_resolution(samples, end)
}

/// Resolution of a channel of decimal numbers: the value of the last digit of `end`, if all samples were written with
/// as many digits as the longest one.
fn written_resolution(samples: &[f64], end: f64) -> f64 {
    let digits = |x: &f64| {
        let text = format!("{x:e}");
        let mantissa = text.split('e').next().unwrap_or_default();
        mantissa.chars().filter(char::is_ascii_digit).count() as i32
    };
    let most = samples.iter().map(digits).max().unwrap_or(1);
    10_f64.powi(end.abs().log10().floor() as i32 + 1 - most)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn one_clipped_impact_is_refused_and_coarse_levels_are_not_clipping() {
        let impact = |n: i32| {
            let phase = f64::from(n - 700) / 24.0;
            if (0.0..1.0).contains(&phase) {
                (std::f64::consts::PI * phase).sin()
            } else {
                0.0
            }
        };
        let noise = |n: i32| 1e-3 * (37.0 * f64::from(n)).sin();
        let whole: Vec<f64> = (0..20_000).map(|n| impact(n) + noise(n)).collect();
        assert_eq!(clipped(&whole), None);
        let cut: Vec<f64> = whole.iter().map(|x| x.min(0.8)).collect();
        assert_eq!(clipped(&cut), Some(0.8));
        // With 64 levels the top of an impact is flat, but its flanks fall level by level.
        let coarse: Vec<f64> = whole.iter().map(|x| (64.0 * x).round() / 64.0).collect();
        assert_eq!(clipped(&coarse), None);
        // With few decimal digits, the steps of the numbers are finer beside the top than at the top.
        for digits in [2, 3] {
            let written = whole.iter().map(|x| format!("{x:.digits$e}").parse().unwrap());
            assert_eq!(clipped(&written.collect::<Vec<f64>>()), None);
        }
        // A force that is held and released is no impact.
        let held: Vec<f64> = (0..2000).map(|n| if n < 900 { 1.0 } else { 0.0 }).collect();
        assert_eq!(clipped(&held), None);
    }

    #[test]
    fn repeated_flat_tops_are_clipping_and_tones_are_not() {
        let tone: Vec<f64> = (0..5000).map(|n| (0.05 * f64::from(n)).sin()).collect();
        assert_eq!(clipped(&tone), None);
        let cut: Vec<f64> = tone.iter().map(|x| x.clamp(-2.0, 0.8)).collect();
        assert_eq!(clipped(&cut), Some(0.8));
    }
}
