//! Receptances measured with periodic excitation, with the standard deviation of their magnitudes.
//!
//! Robust method of Pintelon and Schoukens, System Identification, 2nd ed. (2012), ch. 4: the scatter over the periods
//! of one realization is noise; the scatter over realizations with different random phases is noise and nonlinear
//! distortion.

use num_complex::Complex64;

use super::distortion::distortion;
use super::recording_group::{MeasuredGroup, RecordingGroup, receptances};
use crate::clipping::Clipping;
use crate::criteria::{MULTISINE_LINES_MIN, PERIODS_RECORDED_MIN, SAME_PHASES};
use crate::error::FrfError;
use crate::estimate::{Estimator, FrfLine};
use crate::measurement_settings::{MeasurementSettings, band};
use crate::period::{long_period, period};
use crate::period_average::{PeriodAverage, period_average};
use crate::periodic_test::PeriodicTest;
use crate::small_matrix::ZERO;
use crate::test_channels::TestChannels;
use crate::test_plausibility::is_cut;
use quietcut_recording::TestKind;

/// True if a recording can be evaluated by averages over periods instead of windows: it [may have a periodic
/// force](may_be_periodic), and either the settings state a period, or the force has one and at least
/// [`MULTISINE_LINES_MIN`] excited lines in the band to evaluate.
pub(super) fn recognized(channels: &TestChannels<'_>, settings: &MeasurementSettings) -> bool {
    let Some(force) = may_be_periodic(channels) else {
        return false;
    };
    settings.period_s.is_some()
        || period(force, None).is_ok_and(|samples| is_multisine(channels, force, samples, settings))
}

/// Warning that a force repeats like a multisine, but that the record holds too few periods for averages over them;
/// `None` if it does not repeat, or if the settings state a period.
pub(super) fn too_few_periods(channels: &TestChannels<'_>, settings: &MeasurementSettings) -> Option<String> {
    let force = may_be_periodic(channels).filter(|_| settings.period_s.is_none())?;
    let samples = long_period(force).filter(|samples| is_multisine(channels, force, *samples, settings))?;
    Some(format!(
        "{}: the force repeats after {samples} samples ({:.4} s), and the record holds {:.1} periods: fewer than {PERIODS_RECORDED_MIN}, so that it is \
         evaluated as random excitation, whose windows leak from line to line; record {PERIODS_RECORDED_MIN} periods or more",
        channels.recording.path.display(),
        samples as f64 / channels.recording.sample_rate_hz,
        force.len() as f64 / samples as f64
    ))
}

/// The force of a recording of a shaker or of no stated kind that is not [of a cut](is_cut); `None` for any other
/// recording, and for one with several forces.
fn may_be_periodic<'a>(channels: &TestChannels<'a>) -> Option<&'a [f64]> {
    let ([(_, force)], recording) = (&channels.forces[..], channels.recording) else {
        return None;
    };
    let is_of_shaker = matches!(recording.sidecar.kind, Some(TestKind::Shaker) | None);
    (is_of_shaker && !is_cut(recording)).then_some(&force.samples[..])
}

/// True if a force with a period of `samples` samples has at least [`MULTISINE_LINES_MIN`] excited lines in the band to
/// evaluate.
fn is_multisine(
    channels: &TestChannels<'_>,
    force: &[f64],
    samples: usize,
    settings: &MeasurementSettings,
) -> bool {
    let lines = band(settings, channels.recording.sample_rate_hz, samples);
    period_average(force, &[], samples, lines, &[])
        .is_some_and(|average| average.is_excited.iter().filter(|is| **is).count() >= MULTISINE_LINES_MIN)
}

/// The stated period in samples; `None` if the settings state none. An error if it is not a whole number of two or
/// more.
fn stated_samples(
    channels: &TestChannels<'_>,
    settings: &MeasurementSettings,
) -> Result<Option<usize>, String> {
    let Some(seconds) = settings.period_s else {
        return Ok(None);
    };
    let rate = channels.recording.sample_rate_hz;
    let samples = seconds * rate;
    // A period that was rounded to six digits is within this tolerance.
    if (samples - samples.round()).abs() > 1e-5 * samples || samples.round() < 2.0 {
        return Err(format!(
            "a period of {seconds} s is {samples:.3} samples at {rate} Hz; a whole number of two or more is needed"
        ));
    }
    Ok(Some(samples.round() as usize))
}

/// Measures the receptances of a group of recordings with periodic excitation, at the lines that all of them excite.
pub(super) fn periodic(
    mut group: RecordingGroup,
    members: &[TestChannels<'_>],
    settings: &MeasurementSettings,
    mut warnings: Vec<String>,
) -> Result<MeasuredGroup, FrfError> {
    let first = &members[0];
    let rate = first.recording.sample_rate_hz;
    let mut samples = None;
    let mut averages: Vec<PeriodAverage> = Vec::with_capacity(members.len());
    for channels in members {
        let refused = |what: String| FrfError::Content {
            path: channels.recording.path.clone(),
            what,
        };
        let force = channels.only_force("a record of periodic excitation")?;
        let stated = stated_samples(channels, settings).map_err(refused)?;
        let found = period(&force.samples, stated).map_err(|reason| refused(reason.sentence(rate)))?;
        let common = *samples.get_or_insert(found);
        if found != common {
            return Err(refused(format!(
                "a period of {found} samples, but {} has {common}; recordings that are averaged must have one period",
                first.recording.path.display()
            )));
        }
        let responses: Vec<&[f64]> = channels.signals().split_off(1);
        let clipping = Clipping::of(channels);
        let average = period_average(
            &force.samples,
            &responses,
            found,
            band(settings, rate, found),
            &clipping.is_clipped,
        );
        let (clipped, whole) = clipped_periods(&clipping, found, force.samples.len());
        let warning = clipping.warning(clipped, whole, "periods").map_err(refused)?;
        warnings.extend(warning);
        let average = average.ok_or_else(|| {
            refused(format!(
                "the force changes from period to period; fewer than two periods of {found} samples repeat"
            ))
        })?;
        if average.used < 2 {
            warnings.push(format!(
                "{}: only two periods repeat, of which the first may hold the transient: one period has no scatter, and it is unknown whether the \
                 response had settled; record more periods",
                channels.recording.path.display()
            ));
        } else if !average.is_settled {
            warnings.push(format!(
                "{}: the response had not settled: it changes between the last periods by more than the noise, which is in the interval; record \
                 more periods",
                channels.recording.path.display()
            ));
        }
        averages.push(average);
    }
    let refused = |what: String| FrfError::Content {
        path: first.recording.path.clone(),
        what,
    };
    if settings.estimator != Estimator::H1 {
        warnings.push(
            "--method has no effect on periodic excitation, where averages over periods are free of the bias by noise"
                .into(),
        );
    }
    if settings.resolution_hz.is_some() {
        warnings.push(
            "--resolution-hz has no effect on periodic excitation: its lines are those of the force; --excitation random averages over them"
                .into(),
        );
    }
    let excited = common_lines(&averages).map_err(refused)?;
    let realizations = realizations(&averages);
    if realizations > 1 && realizations < averages.len() {
        // If some recordings share their phases and others do not, the scatter over all of them is no variance of the
        // distortion.
        return Err(refused(format!(
            "{} recordings with {realizations} different sets of phases; take one recording of each realization, or only repetitions of one",
            averages.len()
        )));
    }
    if averages.len() > 1 && realizations == 1 {
        warnings.push(
            "all recordings have the same phases, so that their nonlinear distortion is the same and in no interval; take another realization \
             of random phases for each"
                .into(),
        );
    }
    let spacing_hz = rate / samples.unwrap_or(1) as f64;
    let lines = lines(&averages, &excited, spacing_hz, first.responses.len());
    let test = PeriodicTest {
        period_s: 1.0 / spacing_hz,
        period_samples: samples.unwrap_or(0),
        used: averages.iter().map(|average| average.used).collect(),
        dropped: averages.iter().map(|average| average.dropped).collect(),
        realizations,
        distortions: distortion(&averages, &excited, &lines, first, realizations),
    };
    warnings.extend(test.warning());
    group.averages = averages.iter().map(|average| average.used as f64).sum();
    group.freedoms = Some(freedoms(&averages));
    group.periodic = Some(test);
    Ok(receptances(group, &lines, first, warnings))
}

/// Number of the whole periods that hold a clipped sample, and of all whole periods, in a record of `samples` samples.
/// The last period ends with the record.
fn clipped_periods(clipping: &Clipping, period: usize, samples: usize) -> (usize, usize) {
    let (whole, first) = (samples / period, samples % period);
    let clipped = (0..whole).filter(|index| {
        let start = first + index * period;
        clipping.holds(start..start + period)
    });
    (clipped.count(), whole)
}

/// Degrees of freedom of the standard deviations: 2(M − 1) of one recording with M averaged periods, 2(R − 1) of R
/// recordings.
fn freedoms(averages: &[PeriodAverage]) -> usize {
    match averages {
        [only] => 2 * (only.used - 1),
        several => 2 * (several.len() - 1),
    }
}

/// Indices of the lines that all recordings excite, ascending. An error if there are none, or if any recording excites
/// more than twice as many.
fn common_lines(averages: &[PeriodAverage]) -> Result<Vec<usize>, String> {
    let count = |average: &PeriodAverage| average.is_excited.iter().filter(|is| **is).count();
    let most = averages.iter().map(count).max().unwrap_or(0);
    let lines = averages.first().map_or(0, |average| average.is_excited.len());
    if most == 0 {
        return Err(
            "in the band no line of the force stands above its noise; check the band and the period".into(),
        );
    }
    let common: Vec<usize> = (0..lines)
        .filter(|&line| averages.iter().all(|average| average.is_excited[line]))
        .collect();
    if common.is_empty() || 2 * common.len() < most {
        return Err(format!(
            "of {most} excited lines the recordings have {} in common; realizations of a multisine must excite the same lines in the band",
            common.len()
        ));
    }
    Ok(common)
}

/// Number of different forces among the recordings; forces that [have the same phases](have_same_phases) count once.
fn realizations(averages: &[PeriodAverage]) -> usize {
    let mut different: Vec<&PeriodAverage> = Vec::new();
    for average in averages {
        if !different.iter().any(|other| have_same_phases(other, average)) {
            different.push(average);
        }
    }
    different.len()
}

/// True if two forces are the same signal but for a shift in time: at some shift, the magnitude of the correlation of
/// the lines that both excite exceeds [`SAME_PHASES`].
fn have_same_phases(a: &PeriodAverage, b: &PeriodAverage) -> bool {
    let products: Vec<(f64, Complex64)> = (0..a.force.len())
        .filter(|&line| a.is_excited[line] && b.is_excited[line])
        .map(|line| ((a.first_line + line) as f64, a.force[line] * b.force[line].conj()))
        .collect();
    let whole: f64 = products.iter().map(|(_, product)| product.norm()).sum();
    let highest = products.last().map_or(1.0, |(line, _)| *line);
    // Sixteen shifts per period of the highest common line: half a shift turns a line by 0.2 rad at most. This costs 2
    // % of the part of the line in the correlation.
    let shifts = (16.0 * highest).ceil() as usize;
    (0..shifts).any(|shift| {
        let turn = std::f64::consts::TAU * shift as f64 / shifts as f64;
        let sum: Complex64 = products
            .iter()
            .map(|(line, product)| product * Complex64::from_polar(1.0, turn * line))
            .sum();
        sum.norm() > SAME_PHASES * whole
    })
}

/// FRF at the lines with the indices `excited`: mean over the recordings of G = Ȳ/Ū, with the standard deviation of its
/// magnitude.
///
/// Of one recording with M periods, var G = Σ|Y − Ȳ − G(U − Ū)|²/(M(M − 1)|Ū|²), the variance by noise. Of R recordings
/// it is Σ|G_r − Ḡ|²/(R(R − 1)); with different realizations this includes nonlinear distortion. The variance of the
/// magnitude is half of var G.
fn lines(averages: &[PeriodAverage], excited: &[usize], spacing_hz: f64, responses: usize) -> Vec<FrfLine> {
    let first_line = averages.first().map_or(0, |average| average.first_line);
    let count = averages.len() as f64;
    excited
        .iter()
        .map(|&line| {
            let mut found = FrfLine {
                frequency_hz: (first_line + line) as f64 * spacing_hz,
                h: ZERO,
                coherence: [0.0; 3],
                deviation: [[0.0; 3]; 3],
                folding: [0.0; 3],
                singular: (1.0, 1.0),
            };
            for response in 0..responses {
                let gains: Vec<Complex64> = averages
                    .iter()
                    .map(|average| average.gain(response, line))
                    .collect();
                let mean = gains.iter().sum::<Complex64>() / count;
                let variance = match averages {
                    [only] => only.noise_variance(response, line),
                    _ => {
                        gains.iter().map(|gain| (gain - mean).norm_sqr()).sum::<f64>() / (count - 1.0) / count
                    }
                };
                // Power of the linear response to the mean force, summed over the averaged periods of all recordings.
                let linear: f64 = averages
                    .iter()
                    .map(|average| average.used as f64 * (mean * average.force[line]).norm_sqr())
                    .sum();
                let all: f64 = averages
                    .iter()
                    .map(|average| average.used as f64 * average.responses[response].power[line])
                    .sum();
                found.h[response][0] = mean;
                found.deviation[response][0] = (0.5 * variance).sqrt();
                found.coherence[response] = if all > 0.0 {
                    (linear / all).clamp(0.0, 1.0)
                } else {
                    0.0
                };
            }
            found
        })
        .collect()
}
