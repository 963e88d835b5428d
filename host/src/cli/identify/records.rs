//! Identification from records of force and motion: multisine harmonic balance and restoring-force surface.

use super::Error;
use super::answer::{IdentifyOutput, Slices};
use super::args::{Args, SurfaceTerm};
use super::backbone_answer::average_warning;
use super::figure::Figure;
use super::force_and_motion::{ForceAndMotion, force_and_motion};
use crate::identify::case_file::Estimate;
use crate::identify::law::NonlinearTerm;
use crate::identify::periodic_fit::{self, Period};
use crate::identify::restoring_force::{ForceTerm, Options, Record, Slice, Surface};
use crate::recording::{Quantity, Recording};

/// Identifies parameters by harmonic balance from the last `samples` samples of each multisine recording, which are
/// taken as one period of the multisine.
pub(super) fn multisine(
    args: &Args,
    recordings: &[Recording],
    samples: usize,
) -> Result<IdentifyOutput, Error> {
    let mut taken = Vec::new();
    for recording in recordings {
        let ForceAndMotion {
            direction,
            force,
            motion,
            quantity,
        } = force_and_motion(recording)?;
        if quantity != Quantity::Displacement {
            return Err(Error::input(
                recording.lacks("a displacement along the force, which --period-samples needs"),
            ));
        }
        let from = recording.len().checked_sub(samples).ok_or_else(|| {
            Error::input(format!(
                "{}: {} samples; a period has {samples}",
                recording.path.display(),
                recording.len()
            ))
        })?;
        taken.push((direction, force[from..].to_vec(), &motion[from..]));
    }
    let (Some(first), Some((direction, ..))) = (recordings.first(), taken.first()) else {
        return Err(Error::input("a recording is needed"));
    };
    let other = taken.iter().any(|(other, ..)| other != direction);
    if other
        || recordings
            .iter()
            .any(|recording| recording.sample_rate_hz != first.sample_rate_hz)
    {
        return Err(Error::input(
            "the recordings of a multisine must have one direction and one sample rate",
        ));
    }
    let mut terms = vec![ForceTerm::Mass, ForceTerm::Damping, ForceTerm::Stiffness];
    for extra in &args.terms {
        match extra {
            NonlinearTerm::QuadraticStiffness => terms.push(ForceTerm::QuadraticStiffness),
            NonlinearTerm::CubicStiffness => terms.push(ForceTerm::CubicStiffness),
            NonlinearTerm::SofteningHardening => {
                terms.extend([ForceTerm::CubicStiffness, ForceTerm::QuinticStiffness])
            }
            NonlinearTerm::CubicDamping => terms.push(ForceTerm::CubicDamping),
            NonlinearTerm::ModeCoupling => {
                return Err(Error::input(
                    "--terms mode-coupling: a multisine test has one direction",
                ));
            }
        }
    }
    terms.sort_unstable();
    terms.dedup();
    let periods: Vec<Period<'_>> = taken
        .iter()
        .map(|(_, force, displacement)| Period { force, displacement })
        .collect();
    let fit = periodic_fit::fit(&periods, first.sample_rate_hz, &terms)
        .map_err(|error| Error::input(error.to_string()))?;
    let estimates = fit
        .law
        .iter()
        .zip(&fit.deviations)
        .map(|((term, value), deviation)| Estimate {
            key: term.key(),
            directions: vec![*direction],
            value: *value,
            deviation: *deviation,
        })
        .collect();
    Ok(IdentifyOutput {
        fit_error: Some(fit.relative_error),
        ..IdentifyOutput::of("harmonic-balance", vec![*direction], estimates)
    })
}

pub(super) fn restoring_force(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let [recording] = recordings else {
        return Err(Error::input(format!(
            "{} recordings are given; restoring-force uses one",
            recordings.len()
        )));
    };
    let ForceAndMotion {
        direction,
        force,
        motion,
        quantity,
    } = force_and_motion(recording)?;
    let band_hz = args.band_hz;
    let options = Options {
        terms: args.surface.iter().map(|term| term.term()).collect(),
        mass_kg: args.mass_kg,
        band_hz,
        // Duration cut off at each end of the record, s: two seconds, or a tenth of a record shorter than 20 s. A
        // choice; it should contain several periods of the lowest frequency in the band.
        trim_s: (0.1 * recording.len() as f64 / recording.sample_rate_hz).min(2.0),
    };
    let record = Record {
        force: &force,
        motion,
        quantity,
        rate_hz: recording.sample_rate_hz,
    };
    let surface = record
        .surface(&options)
        .map_err(|error| Error::input(format!("{}: {error}", recording.path.display())))?;
    let slices = slices(&surface, args.slice);
    let mut warnings = Vec::new();
    if slices.is_none() {
        warnings.push(format!(
            "fewer than 12 samples lie within {} of the largest velocity or displacement; use a larger --slice",
            args.slice
        ));
    }
    let has_linear_law = args.surface.iter().all(|term| {
        matches!(
            term,
            SurfaceTerm::Mass | SurfaceTerm::Damping | SurfaceTerm::Stiffness | SurfaceTerm::Offset
        )
    });
    if has_linear_law {
        warnings.extend(average_warning(recording, band_hz));
    }
    let mut estimates: Vec<Estimate> = surface
        .terms
        .iter()
        .zip(surface.theta.iter().zip(surface.deviations.iter()))
        .map(|(term, (value, deviation))| Estimate {
            key: term.key(),
            directions: vec![direction],
            value: *value,
            deviation: *deviation,
        })
        .collect();
    if let Some(mass) = args.mass_kg {
        estimates.push(Estimate {
            key: ForceTerm::Mass.key(),
            directions: vec![direction],
            value: mass,
            deviation: 0.0,
        });
    }
    let [low, high] = surface.band_hz;
    Ok(IdentifyOutput {
        fit_error: Some(surface.force_error),
        slices,
        warnings,
        messages: vec![format!("band {low:.2} to {high:.2} Hz")],
        ..IdentifyOutput::of("restoring-force", vec![direction], estimates)
    })
}

fn slices(surface: &Surface, share: f64) -> Option<Slices> {
    let figures = |slice: &Slice, linear, cubic| {
        [
            (linear, Figure::new(slice.linear.0, slice.linear.1)),
            (cubic, Figure::new(slice.cubic.0, slice.cubic.1)),
        ]
        .into()
    };
    Some(Slices {
        stiffness: figures(
            &surface.stiffness_slice(share)?,
            ForceTerm::Stiffness.key(),
            ForceTerm::CubicStiffness.key(),
        ),
        damping: figures(
            &surface.damping_slice(share)?,
            ForceTerm::Damping.key(),
            ForceTerm::CubicDamping.key(),
        ),
    })
}

impl SurfaceTerm {
    fn term(self) -> ForceTerm {
        match self {
            Self::Mass => ForceTerm::Mass,
            Self::Damping => ForceTerm::Damping,
            Self::Stiffness => ForceTerm::Stiffness,
            Self::QuadraticStiffness => ForceTerm::QuadraticStiffness,
            Self::CubicStiffness => ForceTerm::CubicStiffness,
            Self::QuinticStiffness => ForceTerm::QuinticStiffness,
            Self::CubicDamping => ForceTerm::CubicDamping,
            Self::CoulombFriction => ForceTerm::CoulombFriction,
            Self::Offset => ForceTerm::Offset,
        }
    }
}
