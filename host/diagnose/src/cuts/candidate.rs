//! A further effect in the fit of cuts.

use std::sync::Arc;

use toml::Table;

use crate::candidates::cause::Location;
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;

/// Range of a coordinate.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Coordinate {
    pub lower: f64,
    /// Values at which fits begin; the first where the records are compared with the baseline to first order.
    pub start: f64,
}

impl Coordinate {
    /// A coordinate of both signs that begins at zero.
    pub(crate) const FREE: Self = Self {
        lower: f64::NEG_INFINITY,
        start: 0.0,
    };
    /// A coordinate that is not negative and begins at zero.
    pub(crate) const POSITIVE: Self = Self {
        lower: 0.0,
        start: 0.0,
    };
}

/// Parameters of an effect, by key, at coordinates.
pub(crate) type Parameters = Arc<dyn Fn(&[f64]) -> Vec<(&'static str, f64)> + Send + Sync>;

/// Coordinates of an effect that changes nothing in a case.
type Unchanged = Arc<dyn Fn(&Case) -> Option<Vec<f64>> + Send + Sync>;

/// A form of an effect at a place, with coordinates that are standard normal before the records are seen.
#[derive(Clone)]
pub(crate) struct Candidate {
    pub effect: EffectName,
    pub location: Location,
    pub coordinates: Vec<Coordinate>,
    /// Coordinates from which fits begin, besides the starts of the coordinates.
    pub grid: Vec<Vec<f64>>,
    /// True if the effect is absent where the first coordinate is zero.
    pub vanishes: bool,
    parameters: Parameters,
    /// Where the effect sets a parameter that the case has: its coordinates at the value of a case.
    unchanged: Option<Unchanged>,
}

impl Candidate {
    pub(crate) fn new(
        effect: EffectName,
        location: Location,
        coordinates: Vec<Coordinate>,
        parameters: impl Fn(&[f64]) -> Vec<(&'static str, f64)> + Send + Sync + 'static,
    ) -> Self {
        Self {
            effect,
            location,
            coordinates,
            grid: Vec::new(),
            vanishes: false,
            parameters: Arc::new(parameters),
            unchanged: None,
        }
    }

    /// This candidate, which sets parameters that cases have: `unchanged` are its coordinates at the values of a case.
    pub(crate) fn setting(
        mut self,
        unchanged: impl Fn(&Case) -> Option<Vec<f64>> + Send + Sync + 'static,
    ) -> Self {
        self.unchanged = Some(Arc::new(unchanged));
        self
    }

    /// This candidate for each channel of its place by itself, as an answer lists it.
    pub(crate) fn by_channel(&self) -> Vec<Self> {
        let Location::Channels(names) = &self.location else {
            return vec![self.clone()];
        };
        let of = |name: &String| Self {
            location: Location::Channel(name.clone()),
            ..self.clone()
        };
        names.iter().map(of).collect()
    }

    /// This candidate, absent where its first coordinate is zero, below which it cannot go.
    pub(crate) fn vanishing_at_zero(mut self) -> Self {
        self.vanishes = true;
        self.coordinates[0] = Coordinate::POSITIVE;
        self
    }

    /// True if its first coordinate is the size of an effect whose shape the others tell, and is compared with the records where
    /// the effect is faint: an internal state has no orbit without it, and shapes come from a grid.
    pub(crate) fn is_faint_at_start(&self) -> bool {
        self.vanishes && self.coordinates.len() > 1 && !self.grid.is_empty()
    }

    /// This candidate with further starts.
    pub(crate) fn started_at(mut self, grid: Vec<Vec<f64>>) -> Self {
        self.grid = grid;
        self
    }

    /// Parameters of the effect by key.
    pub(crate) fn parameters(&self, coordinates: &[f64]) -> Vec<(&'static str, f64)> {
        (self.parameters)(coordinates)
    }

    /// The table `[extension.NAME]` of the effect; `None` where it is absent.
    pub(crate) fn table(&self, coordinates: &[f64]) -> Option<Table> {
        if self.vanishes && coordinates.first().is_some_and(|first| *first <= 0.0) {
            return None;
        }
        let mut table = self.location.table();
        if let Location::Channels(names) = &self.location {
            let names = names.iter().map(|name| toml::Value::from(name.as_str()));
            table.insert("channel".into(), toml::Value::Array(names.collect()));
        }
        let mut ratios = Vec::new();
        for (key, value) in self.parameters(coordinates) {
            if key.starts_with("ratio_") {
                ratios.push(toml::Value::from(value));
            } else {
                table.insert(key.into(), value.into());
            }
        }
        if !ratios.is_empty() {
            table.insert("ratio".into(), ratios.into());
        }
        if self.effect == EffectName::AxialDepthModulation {
            table.insert("on".into(), true.into());
        }
        Some(table)
    }

    /// Coordinates at which the records are compared to first order, for a baseline that has become `case`: an effect that sets a
    /// parameter begins at the value that this has there.
    pub(crate) fn starts(&self, case: &Case) -> Vec<Vec<f64>> {
        if !self.grid.is_empty() {
            return self.grid.clone();
        }
        let unchanged = self.unchanged.as_ref().and_then(|unchanged| unchanged(case));
        let first = || {
            let starts = self.coordinates.iter().map(|coordinate| coordinate.start);
            starts.collect()
        };
        vec![unchanged.unwrap_or_else(first)]
    }
}
