//! The library: the causes of a study at their locations, with their regression columns.

use rayon::prelude::*;

use crate::candidates;
use crate::candidates::cause::{Cause, Location, Parameter};
use crate::fit::candidate_model::{CandidateModel, Choice};
use crate::fit::regression::{Regression, Subset};
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;

/// One cause at one location, with the regression columns for each set of its nonlinear parameters.
pub(crate) struct Candidate {
    /// Index of the candidate's cause in `Library::causes`.
    pub cause: usize,
    /// Location of the candidate's cause, for example an axis or a channel.
    pub location: Location,
    /// Each set of the cause's nonlinear parameters, with the indices of its regression columns, one for each
    /// coefficient.
    pub variants: Vec<(Vec<f64>, Vec<usize>)>,
}

/// The causes that a study can contain and their candidates, each a cause at one location.
pub(crate) struct Library {
    /// All causes, whether they have a location in this study or not.
    pub causes: Vec<Box<dyn Cause>>,
    /// The causes at their locations in this study.
    pub candidates: Vec<Candidate>,
    /// Sentences about causes at locations where no regressor can be computed, with the reason.
    pub unexamined: Vec<String>,
}

/// The effects that change mass, stiffness and damping of the structure. One factor on all three matrices is a factor
/// on the dynamic stiffness of the structure.
pub(crate) const OF_DYNAMIC_STIFFNESS: [EffectName; 3] =
    [EffectName::Mass, EffectName::Stiffness, EffectName::Damping];

impl Library {
    /// Computes the regressors of all causes and adds them to the regression.
    pub(crate) fn new(study: &Study<'_>, regression: &mut Regression) -> Self {
        let causes = candidates::all();
        let placed: Vec<(usize, Location, Vec<f64>)> = causes
            .iter()
            .enumerate()
            .flat_map(|(index, cause)| {
                let locations = cause.locations(study);
                locations.into_iter().flat_map(move |location| {
                    let variants = cause.nonlinear_grid(study, &location);
                    variants
                        .into_iter()
                        .map(move |nonlinear_parameters| (index, location.clone(), nonlinear_parameters))
                })
            })
            .collect();
        // A cause that acts along several axes with separate coefficients reuses the columns of each single axis.
        let (each, placed): (Vec<_>, Vec<_>) = placed
            .into_iter()
            .partition(|(_, location, _)| matches!(location, Location::EachOf(_)));
        let computed: Vec<_> = placed
            .into_par_iter()
            .map(|(cause, location, nonlinear_parameters)| {
                let columns = columns(study, &*causes[cause], &location, &nonlinear_parameters);
                (cause, location, nonlinear_parameters, columns)
            })
            .collect();
        let mut library = Self {
            causes,
            ..Self::without_causes()
        };
        let mut failed: Vec<(usize, Location, String)> = Vec::new();
        for (cause, location, nonlinear_parameters, columns) in computed {
            match columns {
                Ok(columns) => {
                    let numbers = columns.iter().map(|column| regression.add(column)).collect();
                    library.put(cause, location, nonlinear_parameters, numbers);
                }
                Err(reason) => failed.push((cause, location, reason)),
            }
        }
        library.unexamined = library.unexamined(failed);
        for (cause, location, nonlinear_parameters) in each {
            if let Some(numbers) = library.columns_along_each(cause, &location, &nonlinear_parameters) {
                library.put(cause, location, nonlinear_parameters, numbers);
            }
        }
        regression.complete();
        library
    }

    /// A library that knows no cause.
    pub(crate) fn without_causes() -> Self {
        Self {
            causes: Vec::new(),
            candidates: Vec::new(),
            unexamined: Vec::new(),
        }
    }

    /// One sentence for each cause at a location where the regressors of all its start values `failed`.
    fn unexamined(&self, failed: Vec<(usize, Location, String)>) -> Vec<String> {
        let mut sentences: Vec<String> = Vec::new();
        let mut known: Vec<(usize, Location)> = Vec::new();
        for (cause, location, reason) in failed {
            let name = self.causes[cause].name();
            let place = (cause, location);
            if self.find(place.0, &place.1).is_none() && !known.contains(&place) {
                sentences.push(format!("{name} ({}) is not examined: {reason}", place.1));
                known.push(place);
            }
        }
        sentences
    }

    fn find(&self, cause: usize, location: &Location) -> Option<usize> {
        self.candidates
            .iter()
            .position(|candidate| candidate.cause == cause && candidate.location == *location)
    }

    fn put(&mut self, cause: usize, location: Location, nonlinear_parameters: Vec<f64>, columns: Vec<usize>) {
        match self.find(cause, &location) {
            Some(known) => self.candidates[known]
                .variants
                .push((nonlinear_parameters, columns)),
            None => self.candidates.push(Candidate {
                cause,
                location,
                variants: vec![(nonlinear_parameters, columns)],
            }),
        }
    }

    /// Regression columns of a cause that acts along each of several axes with separate coefficients, from the columns
    /// of the single axes; `None` at any other location, or if the columns of one axis are missing.
    fn columns_along_each(
        &self,
        cause: usize,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Option<Vec<usize>> {
        let Location::EachOf(axes) = location else {
            return None;
        };
        let mut columns = Vec::new();
        for axis in axes {
            let known = &self.candidates[self.find(cause, &Location::Axis(*axis))?];
            let (_, own) = known
                .variants
                .iter()
                .find(|(known, _)| known == nonlinear_parameters)?;
            columns.extend_from_slice(own);
        }
        Some(columns)
    }

    /// The cause of the candidate with the index `candidate`.
    pub(crate) fn cause(&self, candidate: usize) -> &dyn Cause {
        &*self.causes[self.candidates[candidate].cause]
    }

    /// All choices: every cause at every location with every set of its nonlinear parameters.
    pub(crate) fn choices(&self) -> Vec<Choice> {
        self.candidates
            .iter()
            .enumerate()
            .flat_map(|(candidate, known)| {
                (0..known.variants.len()).map(move |variant| Choice { candidate, variant })
            })
            .collect()
    }

    /// Indices of the regression columns of one cause at one location with one set of nonlinear parameters, one for
    /// each coefficient.
    pub(crate) fn columns(&self, choice: Choice) -> &[usize] {
        &self.candidates[choice.candidate].variants[choice.variant].1
    }

    /// Linear fit of the candidate model that consists of `choices`; `None` if it is not identifiable or not physical.
    pub(crate) fn explain(
        &self,
        study: &Study<'_>,
        regression: &Regression,
        choices: &[Choice],
    ) -> Option<CandidateModel> {
        let columns: Vec<usize> = choices
            .iter()
            .flat_map(|choice| self.columns(*choice))
            .copied()
            .collect();
        let fit = regression.fit(Subset::Whole, &columns)?;
        let model = CandidateModel {
            parameter_count: choices.iter().map(|choice| self.parameter_count(*choice)).sum(),
            choices: choices.to_vec(),
            fit,
            simulated: None,
        };
        self.parameters(study, &model).map(|_| model)
    }

    /// Number of fitted parameters of one cause of a candidate model. Nonlinear parameters that follow from the
    /// coefficients ([`Cause::settled`]) do not count.
    pub(crate) fn parameter_count(&self, choice: Choice) -> usize {
        let (nonlinear_parameters, columns) = &self.candidates[choice.candidate].variants[choice.variant];
        let settles = self
            .cause(choice.candidate)
            .settled(nonlinear_parameters, &vec![1.0; columns.len()])
            .is_some();
        columns.len() + if settles { 0 } else { nonlinear_parameters.len() }
    }

    /// Indices of all regression columns of a candidate model, cause after cause.
    pub(crate) fn columns_of(&self, model: &CandidateModel) -> Vec<usize> {
        model
            .choices
            .iter()
            .flat_map(|choice| self.columns(*choice))
            .copied()
            .collect()
    }

    /// Fitted coefficients of the cause at index `position` in `choices` of a candidate model.
    pub(crate) fn coefficients(&self, model: &CandidateModel, position: usize) -> Vec<f64> {
        let from: usize = model.choices[..position]
            .iter()
            .map(|choice| self.columns(*choice).len())
            .sum();
        model.fit.coefficients[from..from + self.columns(model.choices[position]).len()].to_vec()
    }

    /// Contribution of a candidate model to the residual of each channel of a record, along the measured motion:
    /// samples in the unit of the channel.
    pub(crate) fn explained(
        &self,
        study: &Study<'_>,
        record: &Record,
        model: &CandidateModel,
    ) -> Vec<Vec<f64>> {
        let mut sum = vec![vec![0.0; record.grid.count()]; record.channels.len()];
        for (position, choice) in model.choices.iter().enumerate() {
            let known = &self.candidates[choice.candidate];
            let cause = self.cause(choice.candidate);
            let coefficients = self.coefficients(model, position);
            let regressors =
                cause.regressors(study, record, &known.location, &known.variants[choice.variant].0);
            for (regressor, coefficient) in regressors.iter().flatten().zip(coefficients) {
                for (sum, column) in sum.iter_mut().zip(regressor.columns(record)) {
                    sum.iter_mut()
                        .zip(column)
                        .for_each(|(sum, value)| *sum += coefficient * value);
                }
            }
        }
        sum
    }

    /// χ² of a candidate model on the held-out segments, with coefficients fitted to the fitted segments; χ² of the
    /// baseline if that fit is not possible.
    pub(crate) fn left_held_out(&self, regression: &Regression, model: &CandidateModel) -> f64 {
        let columns = self.columns_of(model);
        match regression.fit(Subset::Fitted, &columns) {
            Some(fit) => regression.left(Subset::HeldOut, &columns, &fit.coefficients),
            None => regression.residual(Subset::HeldOut),
        }
    }

    /// Parameters by key of every cause of a candidate model; `None` if those of one cause are not physical or cannot
    /// be computed, or if several causes are together one effect of another name.
    pub(crate) fn parameters(
        &self,
        study: &Study<'_>,
        model: &CandidateModel,
    ) -> Option<Vec<Vec<Parameter>>> {
        let mut from = 0;
        let parameters: Vec<Vec<Parameter>> = model
            .choices
            .iter()
            .map(|choice| {
                let candidate = &self.candidates[choice.candidate];
                let (nonlinear_parameters, columns) = &candidate.variants[choice.variant];
                let coefficients = &model.fit.coefficients[from..from + columns.len()];
                from += columns.len();
                self.causes[candidate.cause].parameters(
                    study,
                    &candidate.location,
                    nonlinear_parameters,
                    coefficients,
                )
            })
            .collect::<Option<_>>()?;
        (!self.hides_one_effect(&model.choices, &parameters)).then_some(parameters)
    }

    /// Names and tables of the extensions that add a candidate model to a case; `None` as for
    /// [`parameters()`](Self::parameters).
    pub(crate) fn extensions(
        &self,
        study: &Study<'_>,
        model: &CandidateModel,
    ) -> Option<Vec<(&'static str, toml::Table)>> {
        let parameters = self.parameters(study, model)?;
        let of = |(choice, parameters): (&Choice, Vec<Parameter>)| {
            let location = &self.candidates[choice.candidate].location;
            self.cause(choice.candidate)
                .located_effects(location, &parameters)
        };
        let parts = model.choices.iter().zip(parameters).flat_map(of);
        Some(parts.map(|part| (part.name, part.extension)).collect())
    }

    /// For each cause of the candidate model: indices of the regression columns that hold derivatives with respect to
    /// its nonlinear parameters; none if there are no such parameters, if they follow from the coefficients, or if a
    /// derivative cannot be computed.
    pub(crate) fn slopes_of(
        &self,
        study: &Study<'_>,
        regression: &mut Regression,
        model: &CandidateModel,
    ) -> Vec<Vec<usize>> {
        (0..model.choices.len())
            .map(|position| {
                let choice = model.choices[position];
                let coefficients = self.coefficients(model, position);
                let nonlinear_parameters = &self.candidates[choice.candidate].variants[choice.variant].0;
                let cause = self.cause(choice.candidate);
                if nonlinear_parameters.is_empty()
                    || cause.settled(nonlinear_parameters, &coefficients).is_some()
                {
                    return Vec::new();
                }
                self.slopes(study, regression, choice, &coefficients)
                    .unwrap_or_default()
            })
            .collect()
    }

    /// Adds regression columns with the derivatives of a cause's contribution with respect to its nonlinear parameters,
    /// by finite differences (central, one-sided at a bound), and returns their indices; `None` if they cannot be
    /// computed.
    pub(crate) fn slopes(
        &self,
        study: &Study<'_>,
        regression: &mut Regression,
        choice: Choice,
        coefficients: &[f64],
    ) -> Option<Vec<usize>> {
        let known = &self.candidates[choice.candidate];
        let cause = &*self.causes[known.cause];
        let nonlinear_parameters = &known.variants[choice.variant].0;
        let bounds = cause.bounds(study, &known.location);
        (0..nonlinear_parameters.len())
            .map(|parameter| {
                let [low, high] = bounds[parameter];
                let step = 0.01
                    * if low > 0.0 {
                        nonlinear_parameters[parameter]
                    } else {
                        high - low
                    };
                let at = |value: f64| {
                    let mut moved = nonlinear_parameters.clone();
                    moved[parameter] = value.clamp(low, high);
                    let width = moved[parameter];
                    let columns = columns(study, cause, &known.location, &moved).ok()?;
                    Some((columns, width))
                };
                let (above, to) = at(nonlinear_parameters[parameter] + step)?;
                let (below, from) = at(nonlinear_parameters[parameter] - step)?;
                let mut slope = above[0].clone();
                for (record, slope) in slope.iter_mut().enumerate() {
                    for (channel, slope) in slope.iter_mut().enumerate() {
                        for (sample, slope) in slope.iter_mut().enumerate() {
                            *slope = coefficients
                                .iter()
                                .enumerate()
                                .map(|(j, coefficient)| {
                                    let change =
                                        above[j][record][channel][sample] - below[j][record][channel][sample];
                                    coefficient * change / (to - from)
                                })
                                .sum();
                        }
                    }
                }
                Some(regression.add(&slope))
            })
            .collect()
    }

    /// χ² of a linear fit that changes mass, stiffness and damping at `location` by one common relative change, and
    /// that change; `None` if the library lacks one of the three there, or if the change has no effect.
    pub(crate) fn common_factor(&self, regression: &Regression, location: &Location) -> Option<(f64, f64)> {
        let columns: Vec<usize> = OF_DYNAMIC_STIFFNESS
            .iter()
            .map(|effect| {
                self.candidates
                    .iter()
                    .position(|known| {
                        self.causes[known.cause].effect() == *effect && known.location == *location
                    })
                    .map(|index| self.candidates[index].variants[0].1[0])
            })
            .collect::<Option<_>>()?;
        let at = |factor: f64| regression.left(Subset::Whole, &columns, &vec![factor; columns.len()]);
        // χ² is a parabola in the factor: three values determine its minimum.
        let (below, middle, above) = (at(-1.0), at(0.0), at(1.0));
        let curvature = below + above - 2.0 * middle;
        if curvature <= 0.0 {
            return None;
        }
        let best = 0.5 * (below - above) / curvature;
        Some((at(best), best))
    }

    /// Adds further sets of nonlinear parameters to all candidates: those that the residual `left` of a candidate model
    /// suggests.
    pub(crate) fn add_variants_beside(
        &mut self,
        study: &Study<'_>,
        regression: &mut Regression,
        left: &[Vec<Vec<f64>>],
    ) {
        for candidate in 0..self.candidates.len() {
            let location = &self.candidates[candidate].location;
            for nonlinear_parameters in self.cause(candidate).nonlinear_grid_beside(study, location, left) {
                self.add_variant(study, regression, candidate, nonlinear_parameters);
            }
        }
    }

    /// The choice of a candidate with a set of values of its nonlinear parameters. The set and its regression columns
    /// are added, unless the candidate has the set already; `None` if its regressors cannot be computed.
    pub(crate) fn add_variant(
        &mut self,
        study: &Study<'_>,
        regression: &mut Regression,
        candidate: usize,
        nonlinear_parameters: Vec<f64>,
    ) -> Option<Choice> {
        let known = &self.candidates[candidate];
        if let Some(index) = known
            .variants
            .iter()
            .position(|(known, _)| *known == nonlinear_parameters)
        {
            return Some(Choice {
                candidate,
                variant: index,
            });
        }
        let columns = columns(
            study,
            &*self.causes[known.cause],
            &known.location,
            &nonlinear_parameters,
        )
        .ok()?;
        let numbers = columns.iter().map(|column| regression.add(column)).collect();
        let variants = &mut self.candidates[candidate].variants;
        variants.push((nonlinear_parameters, numbers));
        Some(Choice {
            candidate,
            variant: variants.len() - 1,
        })
    }
}

/// Regressors of a cause by coefficient, record, channel and sample, or the reason why they cannot be computed or are
/// not finite.
fn columns(
    study: &Study<'_>,
    cause: &dyn Cause,
    location: &Location,
    nonlinear_parameters: &[f64],
) -> Result<Vec<Vec<Vec<Vec<f64>>>>, String> {
    let mut by_coefficient: Vec<Vec<Vec<Vec<f64>>>> = Vec::new();
    for record in &study.records {
        for (index, regressor) in cause
            .regressors(study, record, location, nonlinear_parameters)?
            .iter()
            .enumerate()
        {
            if by_coefficient.len() <= index {
                by_coefficient.push(Vec::new());
            }
            by_coefficient[index].push(regressor.columns(record));
        }
    }
    let whole = by_coefficient
        .iter()
        .all(|column| column.iter().flatten().flatten().all(|sample| sample.is_finite()));
    if whole {
        Ok(by_coefficient)
    } else {
        Err("its response to the measured motion is not finite".into())
    }
}

#[cfg(test)]
mod tests;
