//! `--method force-coefficients`: cutting and edge coefficients and runout from cuts with measured forces.

use std::collections::BTreeMap;
use std::path::Path;

use super::Error;
use super::answer::{Cutting, IdentifyOutput};
use super::args::Args;
use super::figure::Figure;
use super::written;
use crate::case::Case;
use crate::identify::case_file::{self, Estimate};
use crate::identify::force_coefficients::{Fit, KEYS, Value, fit, runout};
use crate::identify::force_test::{CuttingTest, Setup};
use crate::recording::Recording;
use crate::report::digits::significant;
use crate::simulate::effect::EffectName;

pub(super) fn force_coefficients(args: &Args, recordings: &[Recording]) -> Result<IdentifyOutput, Error> {
    if args.edge_angle_deg > 90.0 {
        return Err(Error::input(format!(
            "--edge-angle-deg {}: an angle above 0 and up to 90 is needed",
            args.edge_angle_deg
        )));
    }
    if let Some(path) = &args.case {
        check_edge_angle(args.edge_angle_deg, path)?;
    }
    let setup = Setup {
        edge_angle_deg: args.edge_angle_deg,
        feed_direction_deg: args.feed_direction_deg,
        full_cut_s: args.cut_s,
    };
    let tests = recordings
        .iter()
        .map(|recording| CuttingTest::new(recording, setup))
        .collect::<Result<Vec<_>, _>>()?;
    let fit = fit(&tests).map_err(|error| Error::input(error.to_string()))?;
    let estimates: Vec<Estimate> = KEYS
        .into_iter()
        .zip(fit.coefficients)
        .filter_map(|(key, value)| {
            value.map(|value| Estimate {
                key,
                directions: Vec::new(),
                value: value.value,
                deviation: value.deviation,
            })
        })
        .collect();
    let teeth = tests.first().map_or(1, |test| test.teeth);
    let out = written::case_file(&args.out);
    let name = out
        .and_then(std::path::Path::file_stem)
        .unwrap_or_default()
        .to_string_lossy();
    let table = case_file::cutting(&name, &estimates, teeth, args.edge_angle_deg, runout(&fit));
    let table = match (table, out) {
        (Ok(table), _) => Some(table),
        (Err(_), None) => None,
        (Err(error), Some(path)) => {
            return Err(Error::input(format!(
                "--out {}: {error}: fz was not measured",
                path.display()
            )));
        }
    };
    Ok(IdentifyOutput {
        fit_error: Some(fit.relative_error),
        warnings: warnings(&fit, &tests),
        messages: sentences(&fit),
        cutting: Some(Cutting {
            averaged: fit.averaged.map(figures),
            runout_um: fit
                .runout_m
                .iter()
                .map(|value| Figure::new(1e6 * value.value, 1e6 * value.deviation))
                .collect(),
            revolutions: fit.revolutions,
            feeds: fit.feeds,
        }),
        table,
        ..IdentifyOutput::of(EffectName::ForceCoefficients.name(), Vec::new(), estimates)
    })
}

/// Refuses a case whose tool has another edge angle than the one with which the coefficients are identified.
fn check_edge_angle(edge_angle_deg: f64, path: &Path) -> Result<(), Error> {
    let case = Case::read(path).map_err(Error::input)?;
    match case.tool {
        Some(tool) if tool.edge_angle_deg != edge_angle_deg => Err(Error::input(format!(
            "--edge-angle-deg {edge_angle_deg}: {} has tool.edge_angle_deg = {of_case}, and coefficients hold for one edge angle; say \
             --edge-angle-deg {of_case}",
            path.display(),
            of_case = tool.edge_angle_deg
        ))),
        _ => Ok(()),
    }
}

fn figures(values: [Option<Value>; 6]) -> BTreeMap<&'static str, Figure> {
    KEYS.into_iter()
        .zip(values)
        .filter_map(|(key, value)| Some((key, Figure::new(value?.value, value?.deviation))))
        .collect()
}

fn warnings(fit: &Fit, tests: &[CuttingTest]) -> Vec<String> {
    let mut warnings = Vec::new();
    if fit.feeds < 2 {
        warnings.push(
            "all tests have one feed: only the chip thickness along the arc separates edge and cutting coefficients, and mean forces do not identify them; tests at two or more feeds are needed"
                .into(),
        );
    }
    if tests.iter().any(|test| test.displacement.is_none()) {
        warnings.push(
            "some recordings have no displacement of the tool: their chip thickness is computed from feed and runout alone"
                .into(),
        );
    }
    let apart = fit.apart();
    if !apart.is_empty() {
        warnings.push(format!(
            "{}: the values from mean forces and from the fit over the arc differ by more than both intervals. Possible causes: loss of contact through runout where the chip is thin, the phase of the tachometer, the immersion, or an unmeasured motion",
            apart.join(", ")
        ));
    }
    warnings
}

fn sentences(fit: &Fit) -> Vec<String> {
    let mut messages = vec![format!("{} revolutions at {} feeds", fit.revolutions, fit.feeds)];
    if let Some(averaged) = fit.averaged {
        messages.extend(figures(averaged).into_iter().map(|(key, figure)| {
            let [low, high] = figure.ci90;
            format!(
                "from mean forces {key} = {}, 90 % interval {} to {}",
                significant(figure.value, 6),
                significant(low, 6),
                significant(high, 6)
            )
        }));
    }
    if fit.runout_m.len() > 1 {
        let teeth: Vec<String> = fit
            .runout_m
            .iter()
            .map(|value| {
                let figure = Figure::new(1e6 * value.value, 1e6 * value.deviation);
                format!(
                    "{:.2} ({:.2} to {:.2})",
                    figure.value, figure.ci90[0], figure.ci90[1]
                )
            })
            .collect();
        messages.push(format!(
            "runout of the teeth: {} um, 90 % intervals",
            teeth.join(", ")
        ));
    }
    messages
}
