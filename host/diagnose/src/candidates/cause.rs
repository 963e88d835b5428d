//! A cause: a physical term with few parameters that the baseline may lack.
//!
//! To add one: write its file and name it in [`all`](super::all), whose match asks for it.

use std::fmt;

use num_complex::Complex64;

use crate::baseline::direction_of;
use crate::motion::cut_force::CutForce;
use crate::records::domain::Domain;
use crate::records::record::Record;
use crate::records::study::Study;
use quietcut_model::effects::EffectName;
use quietcut_model::structure::Direction;
use quietcut_recording::Quantity;

/// Where a cause acts.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Location {
    /// On the whole machine.
    Everywhere,
    /// Along one of the machine's axes (0, 1, 2).
    Axis(usize),
    /// Along each of these, by a law of its own.
    EachOf(Vec<usize>),
    /// Between two of them.
    Axes(usize, usize),
    /// In a channel.
    Channel(String),
    /// In each of these channels, alike.
    Channels(Vec<String>),
    /// In a channel, from another of the machine's axes.
    ChannelFrom(String, usize),
}

impl Location {
    /// The direction, where it is one.
    pub(crate) fn direction(&self) -> Option<Direction> {
        match self {
            Self::Axis(axis) | Self::ChannelFrom(_, axis) => Some(direction_of(*axis)),
            _ => None,
        }
    }

    /// The channel, where it is one.
    pub(crate) fn channel(&self) -> Option<&str> {
        match self {
            Self::Channel(name) | Self::ChannelFrom(name, _) => Some(name),
            _ => None,
        }
    }

    /// The keys that say this place in an extension.
    pub(crate) fn table(&self) -> toml::Table {
        let mut table = toml::Table::new();
        if let Some(direction) = self.direction() {
            table.insert("direction".into(), direction.name().into());
        }
        if let Some(channel) = self.channel() {
            table.insert("channel".into(), channel.into());
        }
        if let Self::Axes(a, b) = self {
            let names = [a, b].map(|axis| toml::Value::from(direction_of(*axis).name()));
            table.insert("directions".into(), toml::Value::Array(names.into()));
        }
        table
    }
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Everywhere => f.write_str("everywhere"),
            Self::Axis(axis) => write!(f, "{}", direction_of(*axis)),
            Self::EachOf(axes) => {
                let names: Vec<String> = axes.iter().map(|axis| direction_of(*axis).to_string()).collect();
                f.write_str(&names.join(" and "))
            }
            Self::Axes(a, b) => write!(f, "{}-{}", direction_of(*a), direction_of(*b)),
            Self::Channel(name) => f.write_str(name),
            Self::Channels(names) => f.write_str(&names.join(" and ")),
            Self::ChannelFrom(name, axis) => write!(f, "{name} from {}", direction_of(*axis)),
        }
    }
}

/// What one coefficient of a cause adds to a record, per unit of the coefficient.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regressor {
    /// f_r along the machine's axes, N, at the finer samples of the record: filtered by the structure where the force drives,
    /// −H·f_r, and taken as it is where the force is what is compared.
    pub restoring_n: [Vec<f64>; 3],
    /// What it adds to what each channel reads, at the samples of the record; empty for channels that it leaves alone.
    pub observed: Vec<Vec<f64>>,
    /// What it adds to the force of a cut.
    pub cut: Option<CutForce>,
}

impl Regressor {
    /// One that acts by a force.
    pub(crate) fn of_force(restoring_n: [Vec<f64>; 3]) -> Self {
        Self {
            restoring_n,
            ..Self::default()
        }
    }

    /// One that acts on channels.
    pub(crate) fn of_channels(observed: Vec<Vec<f64>>) -> Self {
        Self {
            observed,
            ..Self::default()
        }
    }

    /// One that acts by the force of a cut.
    pub(crate) fn of_cut(force: CutForce) -> Self {
        Self {
            cut: Some(force),
            ..Self::default()
        }
    }

    /// What it adds to the residual of each channel of `record`.
    pub(crate) fn columns(&self, record: &Record) -> Vec<Vec<f64>> {
        let count = record.grid.count();
        let mut columns: Vec<Vec<f64>> = (0..record.channels.len())
            .map(|channel| match self.observed.get(channel) {
                Some(samples) if !samples.is_empty() => samples.clone(),
                _ => vec![0.0; count],
            })
            .collect();
        if let Some(force) = &self.cut {
            for (column, added) in columns.iter_mut().zip(record.read_cut(force)) {
                column
                    .iter_mut()
                    .zip(added)
                    .for_each(|(column, added)| *column += added);
            }
        }
        if self.restoring_n.iter().all(Vec::is_empty) {
            return columns;
        }
        let spectra: [Option<Vec<Complex64>>; 3] = std::array::from_fn(|axis| {
            let force = &self.restoring_n[axis];
            (!force.is_empty() && force.iter().any(|x| *x != 0.0))
                .then(|| record.grid.spectrum_of_fine(force))
        });
        for (index, (channel, column)) in record.channels.iter().zip(&mut columns).enumerate() {
            // The force of a cut is what it is: a spring moves the tool.
            if record.domain == Domain::Response && channel.pickup.quantity == Quantity::Force {
                continue;
            }
            let added: Vec<f64> = match record.domain {
                Domain::Response => {
                    let response = record.read_response(&spectra, index);
                    response.into_iter().map(|x| -x).collect()
                }
                Domain::Force => {
                    let mut sum = vec![Complex64::ZERO; record.grid.fine_bins()];
                    for (weight, spectrum) in channel.pickup.weights.iter().zip(&spectra) {
                        if let Some(spectrum) = spectrum {
                            for (sum, bin) in sum.iter_mut().zip(spectrum) {
                                *sum += bin * *weight;
                            }
                        }
                    }
                    record.grid.samples_of_fine(&sum)
                }
            };
            for (column, added) in column.iter_mut().zip(added) {
                *column += added;
            }
        }
        columns
    }
}

/// A parameter that has been fitted: its key in `parameters` of the answer and in the extension, and its value.
pub(crate) type Parameter = (&'static str, f64);

/// One name of a cause with what belongs to it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Part {
    /// The name, as in `[extension.NAME]`.
    pub name: &'static str,
    /// Where this part acts.
    pub location: Location,
    /// Its parameters.
    pub parameters: Vec<Parameter>,
    /// The extension that makes it part of a case.
    pub extension: toml::Table,
}

/// A physical term that the baseline may lack.
///
/// It is linear in its coefficients once its shape (gap, yield, time constant …) is given:
/// residual = Σ coefficient · regressor(shape, measured motion) + free decays + noise.
pub(crate) trait Cause: Send + Sync {
    /// The effect that it is.
    fn effect(&self) -> EffectName;

    /// Its name, as in `[extension.NAME]`.
    fn name(&self) -> &'static str {
        self.effect().name()
    }

    /// All names that it has in an answer: one, unless it is several that act through each other.
    fn names(&self) -> Vec<&'static str> {
        vec![self.name()]
    }

    /// Where in this scene it could act and be seen; empty where it cannot.
    fn locations(&self, study: &Study<'_>) -> Vec<Location>;

    /// Shapes to begin with: a grid over the parameters that do not enter linearly. One empty shape where all do.
    fn nonlinear_grid(&self, _scene: &Study<'_>, _place: &Location) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    /// Further shapes that are worth a look for what other causes have left, by record and channel.
    fn nonlinear_grid_beside(
        &self,
        _scene: &Study<'_>,
        _place: &Location,
        _left: &[Vec<Vec<f64>>],
    ) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Bounds of the parameters of a shape: lowest and highest.
    fn bounds(&self, _scene: &Study<'_>, _place: &Location) -> Vec<[f64; 2]> {
        Vec::new()
    }

    /// What it adds to a record per unit of each coefficient; `None` where it cannot be computed there.
    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Option<Vec<Regressor>>;

    /// Parameters by key of what was fitted; `None` where no such cause is physical (a negative friction).
    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>>;

    /// The shape at which the regressors would be exact, where the coefficients say so themselves: it is then no freedom of
    /// the fit but found by going there.
    fn settled(&self, _shape: &[f64], _coefficients: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// The extension that makes the cause part of a case.
    fn extension(&self, location: &Location, parameters: &[Parameter]) -> toml::Table {
        let mut table = location.table();
        for (key, value) in parameters {
            table.insert((*key).into(), (*value).into());
        }
        table
    }

    /// What the answer says, name by name: parameters and extension.
    fn parts(&self, location: &Location, parameters: &[Parameter]) -> Vec<Part> {
        vec![Part {
            name: self.name(),
            location: location.clone(),
            parameters: parameters.to_vec(),
            extension: self.extension(location, parameters),
        }]
    }

    /// Standard deviations of parameters that are known otherwise than by the fit, by key.
    fn known_deviations(&self, _scene: &Study<'_>) -> Vec<Parameter> {
        Vec::new()
    }

    /// Parameters that are said beside those of the extension, as the same thing in other words.
    fn also(&self, _scene: &Study<'_>, _place: &Location, _parameters: &[Parameter]) -> Vec<Parameter> {
        Vec::new()
    }
}
