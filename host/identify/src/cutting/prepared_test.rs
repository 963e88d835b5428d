//! A cutting test with the quantities that the steps of the fit of its force coefficients share.

use std::collections::BTreeSet;
use std::f64::consts::TAU;

use nalgebra::Vector3;

use crate::cutting::force_test::CuttingTest;
use quietcut_model::milling::{Immersion, Material, RotatingVector, ToothForce};

/// A cutting test with the quantities that the steps of the fit of its force coefficients share.
pub(super) struct Prepared<'a> {
    pub(super) test: &'a CuttingTest,
    /// Derivatives of the tooth force by the tangential, radial and axial coefficient at the axial depth of the test,
    /// as vectors over the immersion angle. `cutting`: N per unit of each cutting coefficient and per meter of chip
    /// thickness. `edge`: N per unit of each edge coefficient.
    pub(super) cutting: [RotatingVector; 3],
    pub(super) edge: [RotatingVector; 3],
    /// Indices of the samples next to a tooth entry or exit. Part of their sampling interval has another number of
    /// engaged teeth, so the fit leaves them out.
    pub(super) switching: BTreeSet<usize>,
    pub(super) revolutions: Vec<[usize; 2]>,
    /// Weight 1/σ² of the force residual in each direction, with its standard deviation σ; 1/N². It is 1 in the first
    /// step of the fit, and later 0 in the axial direction if the axial coefficients are not fitted.
    pub(super) weights: [f64; 3],
}

/// Tooth force per unit of each pair of cutting and edge coefficient (tangential, radial, axial), for an axial depth of
/// 1 m.
fn vectors(test: &CuttingTest) -> [ToothForce; 3] {
    std::array::from_fn(|index| {
        let unit = |place: usize| f64::from(u8::from(place == index));
        let material = Material {
            ktc_mpa: unit(0),
            krc_mpa: unit(1),
            kac_mpa: unit(2),
            kte_n_per_mm: unit(0),
            kre_n_per_mm: unit(1),
            kae_n_per_mm: unit(2),
        };
        ToothForce::new(test.edge_angle, &material)
    })
}

pub(super) fn prepared(test: &CuttingTest) -> Prepared<'_> {
    let vectors = vectors(test);
    let [from, to] = test.full_cut;
    let mut switching = BTreeSet::new();
    let passes = |angle: f64| (angle / test.pitch()) as i64;
    for pass in passes(test.angle[from]) - 1..=passes(test.angle[to - 1]) + 1 {
        for end in [test.start, test.exit] {
            let sample = test.sample_at(end + pass as f64 * test.pitch());
            switching.extend([sample.saturating_sub(1), sample]);
        }
    }
    Prepared {
        test,
        cutting: vectors.map(|force| force.cutting.scaled(test.depth_m)),
        edge: vectors.map(|force| force.edge.scaled(test.depth_m)),
        switching,
        revolutions: test.revolutions(),
        weights: [1.0; 3],
    }
}

impl Prepared<'_> {
    /// Mean over a revolution of the force that each force coefficient, in the order of
    /// [`KEYS`](super::force_coefficients::KEYS), causes without runout and vibration, N per unit of the coefficient;
    /// and the measured mean force, N.
    ///
    /// Both means are over the same samples: those of the revolution that are not in `switching`.
    pub(super) fn mean_forces(&self, [from, to]: [usize; 2]) -> ([Vector3<f64>; 6], Vector3<f64>) {
        let test = self.test;
        let mut sums = [Vector3::zeros(); 6];
        let (mut force, mut count) = (Vector3::zeros(), 0);
        for sample in (from..to).filter(|sample| !self.switching.contains(sample)) {
            let angle = test.angle[sample];
            force += test.force[sample];
            count += 1;
            for tooth in 0..test.teeth {
                let phi = (angle + tooth as f64 * test.pitch()).rem_euclid(TAU);
                if phi < test.start || phi >= test.exit {
                    continue;
                }
                let thickness_m = test
                    .edge_angle
                    .recession_m(Immersion::new(phi), test.feed_per_tooth_m);
                for part in 0..3 {
                    sums[part] += self.cutting[part].at(phi) * thickness_m;
                    sums[part + 3] += self.edge[part].at(phi);
                }
            }
        }
        let count = f64::from(count.max(1));
        (sums.map(|sum| sum / count), force / count)
    }
}
