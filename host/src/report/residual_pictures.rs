//! Pictures of what a case misses: over time, frequency, spindle orders, amplitude and displacement, and tooth by tooth.

use maud::{Markup, html};

use super::PictureError;
use super::comparison::{Line, Look, comparison};
use super::page::figure;
use super::stroboscope::samples_per_tooth;
use super::time_signal::thinned;
use crate::diagnose::{MissingForce, ResidualView, SpindleMotionView};

/// Points of a cloud, at most.
const POINTS: usize = 3000;

/// Size of the pictures that stand side by side.
const HALF: (u32, u32) = (470, 330);

/// Spindle orders that are shown, as multiples of the teeth.
const ORDERS_PER_TOOTH: f64 = 4.5;

/// Tooth passes that are shown.
const PASSES: usize = 400;

/// All pictures of one channel of one record; `fellows` are the views of all records of that channel.
///
/// # Errors
/// A picture that cannot be drawn.
pub(super) fn pictures(
    view: &ResidualView,
    fellows: &[&ResidualView],
    with_extension: bool,
) -> Result<Markup, PictureError> {
    let what = format!("{} of {}", view.channel, file_name(&view.record));
    let time = if with_extension {
        "over time: what was measured, what the case misses, and what the extended case misses."
    } else {
        "over time: what was measured, and what the case misses."
    };
    let mut halves = vec![figure(
        &over_frequency(view)?,
        "Over frequency, as powers of ten of the amplitude per line. What stays at the level of the noise is explained.",
    )];
    if let Some(turning) = &view.spindle_motion {
        halves.push(figure(
            &over_orders(view, turning)?,
            &format!(
                "Over spindle orders ({:.1} rev/min, {} teeth): what repeats once per turn is runout or the spindle; at multiples of the teeth the force is wrong.",
                turning.rpm, turning.teeth
            ),
        ));
        if turning.residual.len() > 1 {
            halves.push(figure(
                &strobed(&turning.residual, "missed by the case", view)?,
                "Stroboscopic map: what the case misses each time a tooth enters. Lines that part by tooth are runout; clouds that drift are wear, drift or chatter.",
            ));
        }
    }
    if let Some(missing) = &view.missing {
        let all: Vec<&MissingForce> = fellows.iter().filter_map(|view| view.missing.as_ref()).collect();
        if let Some(picture) = over_amplitude(&all)? {
            halves.push(figure(
                &picture,
                "Does the receptance move with force? The stiffness and damping that are missing, as shares of the static stiffness, stretch by stretch over its amplitude, of this channel in all records. Level: a linear parameter; sloped: a term that is not linear.",
            ));
        }
        if let Some(picture) = over_displacement(missing)? {
            halves.push(figure(
                &picture,
                "The restoring force that is missing, over the displacement: a spring that is not linear bends it, friction and play open it.",
            ));
        }
    }
    Ok(html! {
        (figure(&over_time(view, &what)?, &format!("{what} {time}")))
        div.pair { @for half in &halves { (half) } }
    })
}

/// The name of a file without its folders.
pub(super) fn file_name(path: &str) -> &str {
    path.rsplit('/').next().unwrap_or(path)
}

fn signals(view: &ResidualView) -> Vec<(&'static str, Look, &[f64])> {
    let mut signals = vec![
        ("measured", Look::Measured, view.measured.as_slice()),
        ("missed by the case", Look::Missed, view.residual.as_slice()),
    ];
    if !view.left.is_empty() {
        signals.push(("missed with the extension", Look::Left, view.left.as_slice()));
    }
    signals
}

fn over_time(view: &ResidualView, what: &str) -> Result<String, PictureError> {
    let t_s: Vec<f64> = (0..view.measured.len())
        .map(|n| n as f64 / view.rate_hz)
        .collect();
    let lines: Vec<Line> = signals(view)
        .into_iter()
        .map(|(name, look, samples)| Line {
            name: name.into(),
            points: thinned(&t_s, samples),
            look,
        })
        .collect();
    let unit = format!("{} [{}]", view.channel, view.unit);
    comparison((960, 300), [what, "time [s]", &unit], &lines, None)
}

/// Spectra with `scale` frequency units to a hertz, up to `last_hz`.
fn spectra(view: &ResidualView, points: usize, last_hz: f64, scale: f64) -> Vec<Line> {
    let mut lines: Vec<Line> = signals(view)
        .into_iter()
        .map(|(name, look, samples)| Line {
            name: name.into(),
            points: view
                .spectrum(samples, points)
                .into_iter()
                .filter(|(hertz, amplitude)| *amplitude > 0.0 && *hertz <= last_hz)
                .map(|(hertz, amplitude)| (scale * hertz, amplitude.log10()))
                .collect(),
            look,
        })
        .collect();
    // White noise of deviation σ: 2σ/√n per line.
    let noise = 2.0 * view.deviation / (view.measured.len().max(1) as f64).sqrt();
    if let (Some(&(first, _)), Some(&(last, _))) = (lines[0].points.first(), lines[0].points.last())
        && noise > 0.0
    {
        lines.push(Line {
            name: "noise".into(),
            points: vec![(first, noise.log10()), (last, noise.log10())],
            look: Look::Level,
        });
    }
    lines
}

fn over_frequency(view: &ResidualView) -> Result<String, PictureError> {
    let unit = format!("log10 of {} [{}]", view.channel, view.unit);
    let lines = spectra(view, 500, view.highest_hz, 1.0);
    comparison(HALF, ["", "frequency [Hz]", &unit], &lines, None)
}

fn over_orders(view: &ResidualView, turning: &SpindleMotionView) -> Result<String, PictureError> {
    let unit = format!("log10 of {} [{}]", view.channel, view.unit);
    let turns_hz = turning.rpm / 60.0;
    let last_hz = (ORDERS_PER_TOOTH * turning.teeth as f64 * turns_hz).min(0.5 * view.rate_hz);
    // So fine that an order has ten points.
    let points = (5.0 * view.rate_hz / turns_hz) as usize;
    let lines = spectra(view, points, last_hz, turns_hz.recip());
    comparison(HALF, ["", "spindle order", &unit], &lines, None)
}

fn strobed(samples: &[(u32, f64)], what: &str, view: &ResidualView) -> Result<String, PictureError> {
    let shown = &samples[samples.len().saturating_sub(PASSES)..];
    let quantity = format!("{what}: {} [{}]", view.channel, view.unit);
    samples_per_tooth("", &quantity, shown, None)
}

/// `None` where the amplitude does not change enough to tell, within a record and from one to the other.
fn over_amplitude(records: &[&MissingForce]) -> Result<Option<String>, PictureError> {
    let rms = |a: &[f64]| (a.iter().map(|x| x * x).sum::<f64>() / a.len().max(1) as f64).sqrt();
    // Amplitude in µm, and stiffness and damping as shares of the static stiffness; damping times the frequency at which velocity and
    // displacement have their sizes.
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
    if all.len() < 3 || extent(f64::max, 0.0) < 1.2 * extent(f64::min, f64::INFINITY) {
        return Ok(None);
    }
    let every = all.len().div_ceil(POINTS / 2).max(1);
    let cloud = |name: &str, look, of: usize| Line {
        name: name.into(),
        points: all.iter().step_by(every).map(|at| (at[0], at[of])).collect(),
        look,
    };
    let lines = [
        cloud("missing stiffness", Look::Cloud, 1),
        cloud("missing damping · ω", Look::OtherCloud, 2),
    ];
    let labels = ["", "amplitude [µm]", "share of the static stiffness"];
    comparison(HALF, labels, &lines, None).map(Some)
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
        look: Look::Cloud,
    }];
    comparison(
        HALF,
        ["", "displacement [µm]", "missing restoring force [N]"],
        &lines,
        None,
    )
    .map(Some)
}
