//! Which causes explain the residual, and which do so equally well.

use rayon::prelude::*;

use crate::candidates;
use crate::candidates::cause::{Cause, Location, Parameter};
use crate::fit::candidate_model::{CandidateModel, Choice};
use crate::fit::regression::{Regression, Subset};
use crate::records::record::Record;
use crate::records::study::Study;

/// A cause at a place, with the columns of each of its shapes.
pub(crate) struct Candidate {
    /// Its cause, a place in the library.
    pub cause: usize,
    /// Where.
    pub location: Location,
    /// Shapes and the columns that they have.
    pub variants: Vec<(Vec<f64>, Vec<usize>)>,
}

/// The library on a scene.
pub(crate) struct Library {
    /// All causes.
    pub causes: Vec<Box<dyn Cause>>,
    /// Where they could act.
    pub candidates: Vec<Candidate>,
}

impl Library {
    /// All causes on a scene, with their columns added to the regression.
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
        // Along each of several axes it adds what it adds along one after the other.
        let (each, placed): (Vec<_>, Vec<_>) = placed
            .into_iter()
            .partition(|(_, location, _)| matches!(location, Location::EachOf(_)));
        let computed: Vec<_> = placed
            .into_par_iter()
            .filter_map(|(cause, location, nonlinear_parameters)| {
                let columns = columns(study, &*causes[cause], &location, &nonlinear_parameters)?;
                Some((cause, location, nonlinear_parameters, columns))
            })
            .collect();
        let mut library = Self {
            causes,
            candidates: Vec::new(),
        };
        for (cause, location, nonlinear_parameters, columns) in computed {
            let numbers = columns.iter().map(|column| regression.add(column)).collect();
            library.put(cause, location, nonlinear_parameters, numbers);
        }
        for (cause, location, nonlinear_parameters) in each {
            if let Some(numbers) = library.columns_along_each(cause, &location, &nonlinear_parameters) {
                library.put(cause, location, nonlinear_parameters, numbers);
            }
        }
        regression.complete();
        library
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

    /// The columns of a cause along each of several axes: those along one after the other; `None` where one of them is not known.
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

    /// The cause of a candidate.
    pub(crate) fn cause(&self, candidate: usize) -> &dyn Cause {
        &*self.causes[self.candidates[candidate].cause]
    }

    /// Every candidate with every shape.
    pub(crate) fn choices(&self) -> Vec<Choice> {
        self.candidates
            .iter()
            .enumerate()
            .flat_map(|(candidate, known)| {
                (0..known.variants.len()).map(move |variant| Choice { candidate, variant })
            })
            .collect()
    }

    /// The columns of a choice.
    pub(crate) fn columns(&self, choice: Choice) -> &[usize] {
        &self.candidates[choice.candidate].variants[choice.variant].1
    }

    /// The fit of some choices; `None` where they cannot be told from each other, or are not physical.
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

    /// Parameters of a choice that are fitted; what settles by itself is none.
    pub(crate) fn parameter_count(&self, choice: Choice) -> usize {
        let (nonlinear_parameters, columns) = &self.candidates[choice.candidate].variants[choice.variant];
        let settles = self
            .cause(choice.candidate)
            .settled(nonlinear_parameters, &vec![1.0; columns.len()])
            .is_some();
        columns.len() + if settles { 0 } else { nonlinear_parameters.len() }
    }

    /// All columns of an explanation, choice after choice.
    pub(crate) fn columns_of(&self, model: &CandidateModel) -> Vec<usize> {
        model
            .choices
            .iter()
            .flat_map(|choice| self.columns(*choice))
            .copied()
            .collect()
    }

    /// The coefficients of one of the choices.
    pub(crate) fn coefficients(&self, model: &CandidateModel, position: usize) -> Vec<f64> {
        let from: usize = model.choices[..position]
            .iter()
            .map(|choice| self.columns(*choice).len())
            .sum();
        model.fit.coefficients[from..from + self.columns(model.choices[position]).len()].to_vec()
    }

    /// What an explanation adds to the residual of each channel of a record.
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

    /// What is left of the held-out parts if the coefficients come from the fitted ones alone.
    pub(crate) fn left_held_out(&self, regression: &Regression, model: &CandidateModel) -> f64 {
        let columns = self.columns_of(model);
        match regression.fit(Subset::Fitted, &columns) {
            Some(fit) => regression.left(Subset::HeldOut, &columns, &fit.coefficients),
            None => regression.residual(Subset::HeldOut),
        }
    }

    /// The parameters of every cause of an explanation.
    pub(crate) fn parameters(
        &self,
        study: &Study<'_>,
        model: &CandidateModel,
    ) -> Option<Vec<Vec<Parameter>>> {
        let mut from = 0;
        model
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
            .collect()
    }

    /// The extensions that make an explanation part of a case.
    pub(crate) fn extensions(
        &self,
        study: &Study<'_>,
        model: &CandidateModel,
    ) -> Option<Vec<(&'static str, toml::Table)>> {
        let parameters = self.parameters(study, model)?;
        let of = |(choice, parameters): (&Choice, Vec<Parameter>)| {
            let location = &self.candidates[choice.candidate].location;
            self.cause(choice.candidate).parts(location, &parameters)
        };
        let parts = model.choices.iter().zip(parameters).flat_map(of);
        Some(parts.map(|part| (part.name, part.extension)).collect())
    }

    /// By choice of an explanation: columns of the change of what it adds per unit of each parameter of its shape; none where the
    /// shape is no freedom of the fit.
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

    /// Columns of the change of what a choice with these coefficients adds, per unit of each parameter of its shape.
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
                    columns(study, cause, &known.location, &moved).map(|columns| (columns, width))
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

    /// What is left if one factor on mass, stiffness and damping at `place` stands for everything, and that factor less one.
    pub(crate) fn common_factor(&self, regression: &Regression, location: &Location) -> Option<(f64, f64)> {
        let columns: Vec<usize> = ["mass", "stiffness", "damping"]
            .iter()
            .map(|name| {
                self.candidates
                    .iter()
                    .position(|known| self.causes[known.cause].name() == *name && known.location == *location)
                    .map(|index| self.candidates[index].variants[0].1[0])
            })
            .collect::<Option<_>>()?;
        let at = |factor: f64| regression.left(Subset::Whole, &columns, &vec![factor; columns.len()]);
        // A parabola in the factor.
        let (below, middle, above) = (at(-1.0), at(0.0), at(1.0));
        let curvature = below + above - 2.0 * middle;
        if curvature <= 0.0 {
            return None;
        }
        let best = 0.5 * (below - above) / curvature;
        Some((at(best), best))
    }

    /// Adds the shapes that are worth a look for what an explanation leaves.
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

    /// Adds a shape to a candidate; `None` where it has no columns.
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
        )?;
        let numbers = columns.iter().map(|column| regression.add(column)).collect();
        let variants = &mut self.candidates[candidate].variants;
        variants.push((nonlinear_parameters, numbers));
        Some(Choice {
            candidate,
            variant: variants.len() - 1,
        })
    }
}

/// Samples by coefficient, record and channel.
fn columns(
    study: &Study<'_>,
    cause: &dyn Cause,
    location: &Location,
    nonlinear_parameters: &[f64],
) -> Option<Vec<Vec<Vec<Vec<f64>>>>> {
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
    whole.then_some(by_coefficient)
}
