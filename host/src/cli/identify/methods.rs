//! Identification from steady sine responses: harmonic balance, higher-order FRFs, nonlinear complex modes.

use std::f64::consts::TAU;

use nalgebra::DVector;

use super::answer::{Coefficients, IdentifyOutput, Maps};
use super::args::Args;
use super::{Error, records};
use crate::criteria::{BIASED_PREDICTION, SAME_FREQUENCY, SAME_LEVEL};
use crate::identify::case_file::Estimate;
use crate::identify::dwell::Dwell;
use crate::identify::harmonic_balance::Grid;
use crate::identify::hfrf as higher_order;
use crate::identify::law::{Law, NonlinearTerm, Role};
use crate::identify::ncma::{Curve, Map};
use crate::identify::steady::{Settling, slowest_decay, steady};
use crate::identify::steady_fit::{Data, Fit, FitError};
use crate::recording::Recording;
use crate::report::digits::significant;
use crate::structure::Direction;

pub(super) fn harmonic_balance(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    if let Some(samples) = args.period_samples {
        return records::multisine(args, recordings, samples as usize);
    }
    let found = fit_steady(args, recordings, &args.terms)?;
    let SteadyFit {
        law,
        directions,
        fit,
        dwells,
        mut warnings,
    } = found;
    if fit.robust {
        warnings.push(format!(
            "the residual exceeds the noise by a factor of {:.1}: the force law is incomplete, and the intervals are estimated from the scatter between dwells; other --terms may fit better",
            fit.misfit.sqrt()
        ));
    }
    let deviations: Vec<f64> = (0..law.parameters.len())
        .map(|p| fit.covariance[(p, p)].max(0.0).sqrt())
        .collect();
    let estimates = estimates(&law, &directions, &fit.theta, &deviations);
    Ok(IdentifyOutput {
        fit_error: Some(fit.relative_error),
        misfit: Some(fit.misfit),
        dwells: Some(dwells.len()),
        warnings,
        ..IdentifyOutput::of("harmonic-balance", directions, estimates)
    })
}

struct SteadyFit {
    law: Law,
    directions: Vec<Direction>,
    fit: Fit,
    dwells: Vec<Dwell>,
    warnings: Vec<String>,
}

/// Directions whose motion is measured in every steady response and whose force is measured in at least one.
fn directions(dwells: &[Dwell]) -> Vec<Direction> {
    Direction::ALL
        .into_iter()
        .filter(|direction| {
            dwells
                .iter()
                .all(|dwell| dwell.motions.iter().any(|line| line.direction == *direction))
        })
        .filter(|direction| {
            dwells
                .iter()
                .any(|dwell| dwell.forces.iter().any(|line| line.direction == *direction))
        })
        .collect()
}

pub(super) fn settling(args: &Args) -> Settling {
    args.settle_s.map_or(Settling::Half, Settling::Seconds)
}

fn fit_steady(args: &Args, recordings: &[Recording], extras: &[NonlinearTerm]) -> Result<SteadyFit, Error> {
    let harmonics = usize::from(args.harmonics);
    let first = steady(recordings, harmonics, settling(args));
    let directions = directions(&first.dwells);
    if directions.is_empty() {
        let why = first.warnings.join("; ");
        return Err(Error::input(format!(
            "no direction has a measured force and a steady measured motion{}{why}",
            if why.is_empty() { "" } else { ": " }
        )));
    }
    let law = Law::new(directions.len(), extras);
    let grid = Grid::new(harmonics, law.degree());
    let data = |dwells: &[Dwell]| -> Result<Fit, FitError> {
        let data = Data {
            law: &law,
            directions: &directions,
            dwells,
            grid: &grid,
        };
        data.fit(data.first_guess()?)
    };
    let refused = |error: FitError| Error::input(error.to_string());
    let mut fit = data(&first.dwells).map_err(refused)?;
    let mut taken = first;
    if args.settle_s.is_none() {
        let diagonal = |of: fn(usize) -> Role| -> Vec<f64> {
            (0..directions.len())
                .filter_map(|i| law.index(of(i)).map(|index| fit.theta[index]))
                .collect()
        };
        let decay = slowest_decay(
            &diagonal(|i| Role::Mass(i, i)),
            &diagonal(|i| Role::Damping(i, i)),
        );
        let settled = steady(recordings, harmonics, Settling::Decay(decay));
        fit = data(&settled.dwells).map_err(refused)?;
        taken = settled;
    }
    Ok(SteadyFit {
        law,
        directions,
        fit,
        dwells: taken.dwells,
        warnings: taken.warnings,
    })
}

fn estimates(law: &Law, directions: &[Direction], theta: &DVector<f64>, deviations: &[f64]) -> Vec<Estimate> {
    law.parameters
        .iter()
        .enumerate()
        .map(|(index, parameter)| Estimate {
            key: parameter.role.key(),
            directions: parameter
                .role
                .dofs()
                .into_iter()
                .map(|dof| directions[dof])
                .collect(),
            value: theta[index],
            deviation: deviations[index],
        })
        .collect()
}

pub(super) fn hfrf(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let found = fit_steady(
        args,
        recordings,
        &[NonlinearTerm::CubicStiffness, NonlinearTerm::CubicDamping],
    )?;
    let [direction] = found.directions[..] else {
        return Err(Error::input(
            "higher-order FRFs hold for one direction at a time (eq. 5.5); give recordings of one direction",
        ));
    };
    let responses = higher_order::responses(&found.dwells, SAME_FREQUENCY);
    let fit = higher_order::fit(&responses).map_err(|error| Error::input(error.to_string()))?;
    let grid = Grid::new(usize::from(args.harmonics), fit.law.degree());
    let data = Data {
        law: &fit.law,
        directions: &found.directions,
        dwells: &found.dwells,
        grid: &grid,
    };
    let predicted = data.relative_error(&fit.theta);
    let mut warnings = found.warnings;
    // Parameters that are correct within the noise predict the steady responses about as well as those of the
    // harmonic-balance fit. A much larger prediction error shows that the parameters from higher-order FRFs are biased.
    if predicted > BIASED_PREDICTION.0 * found.fit.relative_error + BIASED_PREDICTION.1 {
        let mut shifts = Vec::new();
        for role in [Role::CubicDamping(0), Role::CubicStiffness(0)] {
            if let (Some(i), Some(j)) = (fit.law.index(role), found.law.index(role)) {
                let other = found.fit.theta[j];
                shifts.push(format!(
                    "{} {:+.0} %",
                    role.key(),
                    100.0 * (fit.theta[i] / other - 1.0)
                ));
            }
        }
        warnings.push(format!(
            "the prediction error of these parameters on the same data is {:.1} % (harmonic balance: {:.2} %): eqs 5.15 to 5.17 are exact only in the limit of zero force and biased at these levels (against harmonic balance: {}); use --method harmonic-balance",
            100.0 * predicted,
            100.0 * found.fit.relative_error,
            shifts.join(", ")
        ));
    }
    let deviations: Vec<f64> = fit.deviations.iter().copied().collect();
    let estimates = estimates(&fit.law, &[direction], &fit.theta, &deviations);
    Ok(IdentifyOutput {
        fit_error: Some(predicted),
        dwells: Some(found.dwells.len()),
        warnings,
        ..IdentifyOutput::of("hfrf", vec![direction], estimates)
    })
}

pub(super) fn ncma(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    let taken = steady(recordings, usize::from(args.harmonics), settling(args));
    let curves = curves(&taken.dwells);
    let points: Vec<_> = curves.iter().flat_map(|curve| curve.linearized(0.4)).collect();
    // A map (natural frequency or loss factor over force and receptance) that is quadratic in the force needs three
    // force levels; with fewer levels it is linear in the force.
    let degree = if curves.len() >= 3 { args.degree.into() } else { 1 };
    let maps = Map::fit(&points, degree, |point| point.omega / TAU)
        .zip(Map::fit(&points, degree, |point| point.loss_factor));
    let Some((frequency, loss)) = maps else {
        return Err(Error::input(format!(
            "{} pairs of points on both sides of a peak were found at {} force levels; at least 6 at 2 levels are needed: use fine frequency steps through the resonance at several forces",
            points.len(),
            curves.len()
        )));
    };
    let messages = [("frequency_hz", &frequency), ("loss_factor", &loss)]
        .map(|(name, map)| {
            let polynomials: Vec<String> = map
                .coefficients
                .chunks(degree + 1)
                .map(|polynomial| {
                    let powers = polynomial.iter().zip((0..=degree).rev());
                    let terms: Vec<String> = powers
                        .map(|(c, power)| {
                            format!(
                                "{}{} F^{power}",
                                if *c < 0.0 { "" } else { "+" },
                                significant(*c, 5)
                            )
                        })
                        .collect();
                    format!("({})", terms.join(" "))
                })
                .collect();
            format!(
                "{name} = {} (X/F)^2 + {} (X/F) + {}, within {:.3} %",
                polynomials[0],
                polynomials[1],
                polynomials[2],
                100.0 * map.relative_error
            )
        })
        .to_vec();
    Ok(IdentifyOutput {
        dwells: Some(taken.dwells.len()),
        maps: Some(Maps {
            frequency_hz: Coefficients::new(&frequency),
            loss_factor: Coefficients::new(&loss),
        }),
        warnings: taken.warnings,
        messages,
        ..IdentifyOutput::of("ncma", Vec::new(), Vec::new())
    })
}

/// Receptances over frequency at constant force amplitude, one curve for each force level of the dwells.
fn curves(dwells: &[Dwell]) -> Vec<Curve> {
    let mut curves: Vec<Curve> = Vec::new();
    for response in higher_order::responses(dwells, 0.0) {
        for (force, q) in response.levels {
            let point = (response.omega, q / force);
            match curves
                .iter_mut()
                .find(|curve| (curve.force_n / force - 1.0).abs() < SAME_LEVEL)
            {
                Some(curve) => curve.points.push(point),
                None => curves.push(Curve {
                    force_n: force,
                    points: vec![point],
                }),
            }
        }
    }
    for curve in &mut curves {
        curve.points.sort_by(|a, b| a.0.total_cmp(&b.0));
    }
    curves
}
