//! A sensor that does not sit at the tool tip: the same in its reading as a gain of its channel; where the sidecar says
//! that the sensor sits elsewhere, it is what a gain means there.

use super::gain::{Gain, factor};
use super::one_or_all;
use crate::diagnose::cause::{Cause, Parameter, Place, Regressor};
use crate::diagnose::record::Record;
use crate::diagnose::scene::Scene;

pub(super) struct Offset;

impl Cause for Offset {
    fn name(&self) -> &'static str {
        "sensor-offset-from-tool-tip"
    }

    fn places(&self, scene: &Scene<'_>) -> Vec<Place> {
        one_or_all(scene, self.name())
            .into_iter()
            .filter(|place| scene.sits_elsewhere(place.channel()))
            .collect()
    }

    fn regressors(
        &self,
        scene: &Scene<'_>,
        record: &Record,
        place: &Place,
        shape: &[f64],
    ) -> Option<Vec<Regressor>> {
        Gain.regressors(scene, record, place, shape)
    }

    fn parameters(
        &self,
        _: &Scene<'_>,
        _: &Place,
        _: &[f64],
        coefficients: &[f64],
    ) -> Option<Vec<Parameter>> {
        Some(vec![("ratio", factor(coefficients)?)])
    }
}
