//! A cause: a physical term with few parameters that the baseline may lack.
//!
//! To add one: write its file and name it in the match of `candidates::of`.

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
    /// Location of a cause that acts on the whole machine or along all its axes, or of a sensor error in all channels
    /// of motion.
    Everywhere,
    /// Location of a cause that acts along one of the machine's axes (0, 1, 2).
    Axis(usize),
    /// Location of a cause that acts along each of these machine axes, with separate coefficients for each axis.
    EachOf(Vec<usize>),
    /// Location of a cause that couples two of the machine's axes.
    Axes(usize, usize),
    /// Location of a sensor error in the channel of this name.
    Channel(String),
    /// Location of a sensor error in all channels of these names, with the same coefficients.
    Channels(Vec<String>),
    /// Location of a cross-axis error: the channel of this name also reads this axis of the machine.
    ChannelFrom(String, usize),
}

impl Location {
    /// Direction x, y or z of a cause's location, if that is [`Axis`](Self::Axis) or
    /// [`ChannelFrom`](Self::ChannelFrom); otherwise `None`.
    pub(crate) fn direction(&self) -> Option<Direction> {
        match self {
            Self::Axis(axis) | Self::ChannelFrom(_, axis) => Some(direction_of(*axis)),
            _ => None,
        }
    }

    /// Channel name of a cause's location, if that is [`Channel`](Self::Channel) or [`ChannelFrom`](Self::ChannelFrom);
    /// otherwise `None`.
    pub(crate) fn channel(&self) -> Option<&str> {
        match self {
            Self::Channel(name) | Self::ChannelFrom(name, _) => Some(name),
            _ => None,
        }
    }

    /// Those of the keys `direction`, `directions` and `channel` by which a table `[extension.NAME]` states this
    /// location of a cause.
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

/// Contribution of a candidate cause to the residual of a record, per unit of one coefficient of the cause.
#[derive(Clone, Debug, Default)]
pub(crate) struct Regressor {
    /// Restoring force f_r of the cause per unit of its coefficient, along the machine's axes, N, upsampled; empty
    /// along an axis without force. A record in the response domain compares −H·f_r with the residual, a record in the
    /// force domain f_r itself.
    pub restoring_n: [Vec<f64>; 3],
    /// Contribution of the cause to the readings, by channel and sample of the record, for causes such as sensor errors
    /// that act on readings; empty for a channel without contribution, and as a whole for other causes.
    pub observed: Vec<Vec<f64>>,
    /// Contribution of the cause to the cutting force per unit of its coefficient, in a record of a cut; `None` if
    /// there is none.
    pub cut: Option<CutForce>,
}

impl Regressor {
    /// Regressor of a cause that is a restoring force.
    pub(crate) fn of_force(restoring_n: [Vec<f64>; 3]) -> Self {
        Self {
            restoring_n,
            ..Self::default()
        }
    }

    /// Regressor of a cause whose contribution to the readings of the channels is given, such as a sensor error.
    pub(crate) fn of_channels(observed: Vec<Vec<f64>>) -> Self {
        Self {
            observed,
            ..Self::default()
        }
    }

    /// Regressor of a cause that changes the cutting force.
    pub(crate) fn of_cut(force: CutForce) -> Self {
        Self {
            cut: Some(force),
            ..Self::default()
        }
    }

    /// Contribution of this regressor to the residual of each channel of `record`, in the unit of the channel per unit
    /// of the coefficient, sample by sample.
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
            // A restoring force moves the tool, but is no part of the cutting force that a force channel measures in a
            // cut.
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

/// Regressors of a cause in a record, one for each coefficient, or the reason why they cannot be computed there.
pub(crate) type Regressors = Result<Vec<Regressor>, String>;

/// Error text for a request of regressors at a location where the cause cannot act.
pub(crate) const WRONG_LOCATION: &str = "the cause cannot act at this location";

/// Error text for a request of regressors with a wrong number of nonlinear parameters.
pub(crate) const WRONG_PARAMETERS: &str = "the number of nonlinear parameters is wrong";

/// A fitted parameter: its key in `parameters` of the answer and in the extension, and its value.
pub(crate) type Parameter = (&'static str, f64);

/// One named effect of a candidate cause, with its location, its parameters and its table for the case file.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct LocatedEffect {
    /// The effect's name, as in `[extension.NAME]`.
    pub name: &'static str,
    /// Where the effect acts.
    pub location: Location,
    /// Parameters of the effect.
    pub parameters: Vec<Parameter>,
    /// The table `[extension.NAME]` that adds the effect to a case.
    pub extension: toml::Table,
}

/// A physical term that the baseline may lack.
///
/// It is linear in its coefficients once its nonlinear parameters (gap, yield displacement, time constant …) are given:
/// residual = Σ coefficient · regressor(nonlinear parameters, measured motion) + free decays + noise.
pub(crate) trait Cause: Send + Sync {
    /// The effect of the model that this cause represents.
    fn effect(&self) -> EffectName;

    /// The effect's name, as in `[extension.NAME]`.
    fn name(&self) -> &'static str {
        self.effect().name()
    }

    /// All effect names of the cause in an answer. Most causes have one; friction behind a backlash, for example, has
    /// two.
    fn names(&self) -> Vec<&'static str> {
        vec![self.name()]
    }

    /// Locations at which the cause can act and be measured in this study; empty if there is none.
    fn locations(&self, study: &Study<'_>) -> Vec<Location>;

    /// Sets of start values of the nonlinear parameters. A cause that is linear in all parameters has one empty set;
    /// without any set the cause is no candidate at this location.
    fn nonlinear_grid(&self, _study: &Study<'_>, _location: &Location) -> Vec<Vec<f64>> {
        vec![Vec::new()]
    }

    /// Further sets of start values of the nonlinear parameters, from the residual `_residual` that other causes leave:
    /// samples by record and channel.
    fn nonlinear_grid_beside(
        &self,
        _study: &Study<'_>,
        _location: &Location,
        _residual: &[Vec<Vec<f64>>],
    ) -> Vec<Vec<f64>> {
        Vec::new()
    }

    /// Bounds of the nonlinear parameters: lowest and highest value of each, in their order; empty for a cause without
    /// bounds.
    fn bounds(&self, _study: &Study<'_>, _location: &Location) -> Vec<[f64; 2]> {
        Vec::new()
    }

    /// Regressors of the cause along the motion of a record, one for each coefficient of the cause.
    fn regressors(
        &self,
        study: &Study<'_>,
        record: &Record,
        location: &Location,
        nonlinear_parameters: &[f64],
    ) -> Regressors;

    /// Parameters by key from the fitted coefficients and the nonlinear parameters; `None` if they are not physical, as
    /// a negative friction force, or cannot be computed.
    fn parameters(
        &self,
        study: &Study<'_>,
        location: &Location,
        nonlinear_parameters: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>>;

    /// Nonlinear parameters computed from the fitted coefficients, for a cause whose regressors are exact at those
    /// values: they are found by fixed-point iteration, not by a search. `None` for other causes, or if the
    /// coefficients give no such values.
    fn settled(&self, _nonlinear_parameters: &[f64], _coefficients: &[f64]) -> Option<Vec<f64>> {
        None
    }

    /// The table `[extension.NAME]` that adds the cause to a case.
    fn extension(&self, location: &Location, parameters: &[Parameter]) -> toml::Table {
        let mut table = location.table();
        for (key, value) in parameters {
            table.insert((*key).into(), (*value).into());
        }
        table
    }

    /// Entries of the cause in the answer, for example one for each effect name, axis or channel, with parameters and
    /// extension table.
    fn located_effects(&self, location: &Location, parameters: &[Parameter]) -> Vec<LocatedEffect> {
        vec![LocatedEffect {
            name: self.name(),
            location: location.clone(),
            parameters: parameters.to_vec(),
            extension: self.extension(location, parameters),
        }]
    }

    /// Standard deviations, by key, of those parameters that the tachometer determines instead of the fit to the
    /// channels.
    fn known_deviations(&self, _study: &Study<'_>) -> Vec<Parameter> {
        Vec::new()
    }

    /// Further parameters for the answer that express the same change in other quantities, as a natural frequency
    /// instead of a relative change.
    fn also(&self, _study: &Study<'_>, _location: &Location, _parameters: &[Parameter]) -> Vec<Parameter> {
        Vec::new()
    }
}
