//! Chip thickness of every tooth in a recorded cut, measured from the surface that earlier tooth passings left.

use crate::cutting::force_test::CuttingTest;
use quietcut_model::milling::Immersion;

/// Chip that one tooth cuts at one sample of a recorded cut.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Chip {
    /// Immersion angle, rad.
    pub phi: f64,
    /// Chip thickness, m; positive.
    pub thickness_m: f64,
    /// Index of the tooth that cuts the chip, from 0.
    pub tooth: usize,
    /// Index of the earlier tooth that left the surface from which the chip is cut.
    pub ahead: usize,
}

/// A point of the surface that the last tooth passing has left. `reach_m` is its height along the chip thickness
/// direction, m, over the path of a tooth without vibration and runout in that tooth passing; the runout of the tooth
/// `owner` that cut it is not included.
#[derive(Clone, Copy)]
struct SurfacePoint {
    phi: f64,
    reach_m: f64,
    owner: usize,
}

/// The chips cut at every sample of a cutting test, by sample; `runout_m` is the radial offset r of each tooth, m.
///
/// In tooth passing k the tooth (−k mod N) moves over the arc of engagement. Without feed, and with the tool displaced
/// by u, its edge stands at p(φ) = (sin φ, cos φ, 0)·u sin γ − z cos γ + r sin γ, with the edge angle γ and z the axial
/// component of u (thesis eq. 3.1). With the feed per tooth f, the surface is S_k = max(p_k, S_(k−1) − f sin φ sin γ),
/// and the chip thickness p_k − S_(k−1) + f sin φ sin γ where that is positive.
pub fn chips(test: &CuttingTest, runout_m: &[f64]) -> Vec<Vec<Chip>> {
    let mut chips = vec![Vec::new(); test.angle.len()];
    let (Some(&first), Some(&last)) = (test.angle.first(), test.angle.last()) else {
        return chips;
    };
    let pitch = test.pitch();
    let passes = ((first - test.exit) / pitch).floor() as i64..=((last - test.start) / pitch).ceil() as i64;
    let mut surface: Vec<SurfacePoint> = Vec::new();
    for pass in passes {
        let turned = pass as f64 * pitch;
        let tooth = (-pass).rem_euclid(test.teeth as i64) as usize;
        let samples = test.sample_at(test.start + turned)..test.sample_at(test.exit + turned);
        let mut place = 0;
        let mut left = Vec::with_capacity(samples.len());
        for sample in samples {
            let phi = test.angle[sample] - turned;
            let immersion = Immersion::new(phi);
            let u = test.displacement.as_ref().map_or([0.0; 3], |u| u[sample].into());
            let own = test.edge_angle.reach_m(immersion, 0.0, u);
            let recession = test.edge_angle.recession_m(immersion, test.feed_per_tooth_m);
            // If no sample of the tooth passing before is recorded, the surface is that of a passing without vibration.
            let before = surface_at(&surface, phi, &mut place).unwrap_or(SurfacePoint {
                phi,
                reach_m: 0.0,
                owner: (tooth + 1) % test.teeth,
            });
            let thickness_m = own - before.reach_m
                + (runout_m[tooth] - runout_m[before.owner]) * test.edge_angle.sin()
                + recession;
            if thickness_m > 0.0 {
                chips[sample].push(Chip {
                    phi,
                    thickness_m,
                    tooth,
                    ahead: before.owner,
                });
                left.push(SurfacePoint {
                    phi,
                    reach_m: own,
                    owner: tooth,
                });
            } else {
                left.push(SurfacePoint {
                    phi,
                    reach_m: before.reach_m - recession,
                    owner: before.owner,
                });
            }
        }
        surface = left;
    }
    chips
}

/// The machined surface at the immersion angle `phi`: on the cubic through four neighbouring points that one tooth
/// left, else on the straight line through two, else at the height of one point. `place` is advanced to the index of
/// the last point up to `phi` and never moves back. `None` without points.
fn surface_at(surface: &[SurfacePoint], phi: f64, place: &mut usize) -> Option<SurfacePoint> {
    while *place + 1 < surface.len() && surface[*place + 1].phi <= phi {
        *place += 1;
    }
    let left = *surface.get(*place)?;
    let around = |before: usize, after: usize| {
        let points = surface.get(place.checked_sub(before)?..=*place + after)?;
        let is_one = points.iter().all(|point| point.owner == left.owner);
        (is_one && phi > left.phi).then(|| interpolated(points, phi))
    };
    let reach_m = around(1, 2).or_else(|| around(0, 1)).unwrap_or(left.reach_m);
    Some(SurfacePoint { reach_m, ..left })
}

/// Height at the immersion angle `phi` of the Lagrange polynomial through all given points of the surface, m.
fn interpolated(points: &[SurfacePoint], phi: f64) -> f64 {
    let weight = |i: usize| -> f64 {
        let others = points.iter().enumerate().filter(|(j, _)| *j != i);
        others
            .map(|(_, other)| (phi - other.phi) / (points[i].phi - other.phi))
            .product()
    };
    (0..points.len()).map(|i| weight(i) * points[i].reach_m).sum()
}
