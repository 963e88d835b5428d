//! Pictures of one channel: of its residual, measured samples minus those of the model, over time, frequency, spindle
//! order and tooth passing; of the missing force over vibration amplitude and displacement.

use maud::{Markup, html};

use super::PictureError;
use super::comparison::{Line, LineRole, comparison};
use super::page::figure;
use super::stroboscope::samples_per_tooth;
use super::time_signal::thinned;
use crate::criteria::AMPLITUDE_RATIO;
use crate::diagnose::{MissingForce, ResidualView, SpindleMotionView};

/// Largest number of points in a scatter plot of the missing force, or of missing stiffness and damping together: a
/// choice that limits the file size.
const POINTS: usize = 3000;

/// Width and height in pixels of residual pictures that stand side by side.
const HALF_WIDTH_SIZE: (u32, u32) = (470, 330);

/// Highest spindle order in the picture divided by the number of teeth, unless half the sample rate is lower: a choice
/// that shows four harmonics of the tooth passing.
const ORDERS_PER_TOOTH: f64 = 4.5;

/// Largest number of tooth passings in the stroboscopic picture, the last ones of the record: a choice.
const PASSINGS: usize = 400;

/// Residual pictures of one channel of one record, those for which there are data; `channel_views` are the views of the
/// channels of this name in all records, for the picture over the vibration amplitude.
///
/// # Errors
/// A picture cannot be drawn.
pub(super) fn pictures(
    view: &ResidualView,
    channel_views: &[&ResidualView],
    with_extension: bool,
) -> Result<Markup, PictureError> {
    let what = format!("{} of {}", view.channel, file_name(&view.record));
    let time = if with_extension {
        "over time: measured signal, residual of the case, and residual of the extended case."
    } else {
        "over time: measured signal and residual of the case."
    };
    let mut halves = vec![figure(
        &over_frequency(view)?,
        "Amplitude spectrum, logarithm to base 10. A residual at the noise level is explained.",
    )];
    if let Some(spindle) = &view.spindle_motion {
        halves.push(figure(
            &over_orders(view, spindle)?,
            &format!(
                "Spectrum over spindle orders ({:.1} rev/min, {} teeth). Order 1: runout or spindle error; multiples of the number of teeth: error of the cutting force.",
                spindle.rpm, spindle.teeth
            ),
        ));
        if spindle.residual.len() > 1 {
            halves.push(figure(
                &stroboscopic_map(&spindle.residual, "residual of the case", view)?,
                "Stroboscopic map: residual at each tooth entry. Separate lines for each tooth: runout; drifting points: wear, drift or chatter.",
            ));
        }
    }
    if let Some(missing) = &view.missing {
        let all: Vec<&MissingForce> = channel_views
            .iter()
            .filter_map(|view| view.missing.as_ref())
            .collect();
        if let Some(picture) = over_amplitude(&all)? {
            halves.push(figure(
                &picture,
                "Missing stiffness and damping relative to the static stiffness, over the amplitude of each segment, for this channel in all records. Constant: error of a linear parameter; dependent on amplitude: nonlinear term.",
            ));
        }
        if let Some(picture) = over_displacement(missing)? {
            halves.push(figure(
                &picture,
                "Missing restoring force over displacement. Curved: nonlinear spring; loop: friction or backlash.",
            ));
        }
    }
    Ok(html! {
        (figure(&over_time(view, &what)?, &format!("{what} {time}")))
        div.pair { @for half in &halves { (half) } }
    })
}

/// Part of the path after its last slash.
pub(super) fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn signals(view: &ResidualView) -> Vec<(&'static str, LineRole, &[f64])> {
    let mut signals = vec![
        ("measured", LineRole::Measured, view.measured.as_slice()),
        (
            "residual of the case",
            LineRole::BaselineResidual,
            view.residual.as_slice(),
        ),
    ];
    if !view.left.is_empty() {
        signals.push((
            "residual of the extended case",
            LineRole::ExtendedResidual,
            view.left.as_slice(),
        ));
    }
    signals
}

fn over_time(view: &ResidualView, what: &str) -> Result<String, PictureError> {
    let t_s: Vec<f64> = (0..view.measured.len())
        .map(|n| n as f64 / view.rate_hz)
        .collect();
    let lines: Vec<Line> = signals(view)
        .into_iter()
        .map(|(name, role, samples)| Line {
            name: name.into(),
            points: thinned(&t_s, samples),
            role,
        })
        .collect();
    let unit = format!("{} [{}]", view.channel, view.unit);
    comparison((960, 300), [what, "time [s]", &unit], &lines, None)
}

/// Amplitude spectra, as logarithms to base 10, of the measured signal and the residuals of a channel, and its noise
/// level if that is above 0. Each spectrum reaches up to `last_hz` and would have at most `points` points up to half
/// the sample rate; `scale` converts Hz to the unit of the horizontal axis.
fn spectra(view: &ResidualView, points: usize, last_hz: f64, scale: f64) -> Vec<Line> {
    let mut lines: Vec<Line> = signals(view)
        .into_iter()
        .map(|(name, role, samples)| Line {
            name: name.into(),
            points: view
                .spectrum(samples, points)
                .into_iter()
                .filter(|(hertz, amplitude)| *amplitude > 0.0 && *hertz <= last_hz)
                .map(|(hertz, amplitude)| (scale * hertz, amplitude.log10()))
                .collect(),
            role,
        })
        .collect();
    // White noise with standard deviation σ in a record of n samples has the root-mean-square amplitude 2σ/√n at each
    // frequency line.
    let noise = 2.0 * view.deviation / (view.measured.len().max(1) as f64).sqrt();
    if let (Some(&(first, _)), Some(&(last, _))) = (lines[0].points.first(), lines[0].points.last())
        && noise > 0.0
    {
        lines.push(Line {
            name: "noise".into(),
            points: vec![(first, noise.log10()), (last, noise.log10())],
            role: LineRole::Level,
        });
    }
    lines
}

fn over_frequency(view: &ResidualView) -> Result<String, PictureError> {
    let unit = format!("log10 of {} [{}]", view.channel, view.unit);
    let lines = spectra(view, 500, view.highest_hz, 1.0);
    comparison(HALF_WIDTH_SIZE, ["", "frequency [Hz]", &unit], &lines, None)
}

fn over_orders(view: &ResidualView, spindle: &SpindleMotionView) -> Result<String, PictureError> {
    let unit = format!("log10 of {} [{}]", view.channel, view.unit);
    let revolutions_hz = spindle.rpm / 60.0;
    let last_hz = (ORDERS_PER_TOOTH * spindle.teeth as f64 * revolutions_hz).min(0.5 * view.rate_hz);
    // With this number of points up to half the sample rate the spectrum has ten points per spindle order, or fewer in
    // a record shorter than ten revolutions.
    let points = (5.0 * view.rate_hz / revolutions_hz) as usize;
    let lines = spectra(view, points, last_hz, revolutions_hz.recip());
    comparison(HALF_WIDTH_SIZE, ["", "spindle order", &unit], &lines, None)
}

fn stroboscopic_map(samples: &[(u32, f64)], what: &str, view: &ResidualView) -> Result<String, PictureError> {
    let shown = &samples[samples.len().saturating_sub(PASSINGS)..];
    let quantity = format!("{what}: {} [{}]", view.channel, view.unit);
    samples_per_tooth("", &quantity, shown, None)
}

/// Picture of the stiffness and damping that the baseline model lacks, over the displacement amplitude; `None` with
/// fewer than three points, or if the largest amplitude is less than [`AMPLITUDE_RATIO`] times the smallest.
fn over_amplitude(records: &[&MissingForce]) -> Result<Option<String>, PictureError> {
    let rms = |a: &[f64]| (a.iter().map(|x| x * x).sum::<f64>() / a.len().max(1) as f64).sqrt();
    // One point for each segment of each record whose static stiffness is positive: displacement amplitude in µm;
    // missing stiffness k divided by the static stiffness; ω·c divided by the static stiffness, with the missing
    // damping c and ω as the ratio of the root-mean-square values of velocity and displacement over the record.
    let mut all: Vec<[f64; 3]> = Vec::new();
    for missing in records.iter().filter(|missing| missing.stiffness > 0.0) {
        let omega = rms(&missing.v) / rms(&missing.x).max(f64::MIN_POSITIVE);
        all.extend(missing.at_amplitudes().iter().map(|at| {
            [
                1e6 * at.amplitude_m,
                at.stiffness / missing.stiffness,
                omega * at.damping / missing.stiffness,
            ]
        }));
    }
    let extent = |pick: fn(f64, f64) -> f64, start: f64| all.iter().map(|at| at[0]).fold(start, pick);
    if all.len() < 3 || extent(f64::max, 0.0) < AMPLITUDE_RATIO * extent(f64::min, f64::INFINITY) {
        return Ok(None);
    }
    let every = all.len().div_ceil(POINTS / 2).max(1);
    let scatter = |name: &str, role, of: usize| Line {
        name: name.into(),
        points: all.iter().step_by(every).map(|at| (at[0], at[of])).collect(),
        role,
    };
    let lines = [
        scatter("missing stiffness", LineRole::Points, 1),
        scatter("missing damping · ω", LineRole::OtherPoints, 2),
    ];
    let labels = ["", "amplitude [µm]", "relative to the static stiffness"];
    comparison(HALF_WIDTH_SIZE, labels, &lines, None).map(Some)
}

fn over_displacement(missing: &MissingForce) -> Result<Option<String>, PictureError> {
    let every = missing.x.len().div_ceil(POINTS).max(1);
    let points: Vec<(f64, f64)> = missing
        .x
        .iter()
        .zip(&missing.force_n)
        .step_by(every)
        .map(|(x, force)| (1e6 * x, *force))
        .collect();
    if points.len() < 2 || points.iter().all(|point| point.1 == 0.0) {
        return Ok(None);
    }
    let lines = [Line {
        name: "missing force".into(),
        points,
        role: LineRole::Points,
    }];
    comparison(
        HALF_WIDTH_SIZE,
        ["", "displacement [µm]", "missing restoring force [N]"],
        &lines,
        None,
    )
    .map(Some)
}
