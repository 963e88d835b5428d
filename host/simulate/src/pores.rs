//! Porous workpiece material: the solid fraction of the axial depth at the location of a tooth.

use quietcut_model::cutter::{Cutter, Immersion, Tooth};
use quietcut_model::spindle::Spindle;

/// A random foam whose pores are columns along the tool axis.
///
/// Each node of a square lattice in the plane of feed and normal is solid or a pore at random. Between nodes the solid
/// fraction s is interpolated twice differentiably. A tooth cuts the fraction s of its axial depth, so each component
/// of its force is s times that in solid material; the surface that it leaves is the same. The tangential, radial and
/// axial cutting pressures also vary independently by ± `strength` from node to node. The tool feeds between two tooth
/// passings, so that the force has a broad spectrum between the harmonics of the tooth-passing frequency, and its three
/// components are not proportional (thesis section 7.2.1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pores {
    /// Probability that a lattice node is a pore, 0 to 1.
    pub share: f64,
    /// Distance between neighbouring lattice nodes, m.
    pub size_m: f64,
    /// Relative amplitude by which the three cutting pressures vary between nodes, 0 to 1.
    pub strength: f64,
    /// Seed of the random foam.
    pub seed: u64,
}

impl Pores {
    /// Factors on the axial depth in tangential, radial and axial force at the location of `tooth` at the time `t`, s.
    ///
    /// The tool axis moves at constant speed along the feed, from 0 at t = 0. For a tool without diameter the teeth lie
    /// on its axis.
    pub(super) fn at_tooth(&self, cutter: &Cutter, spindle: &Spindle, tooth: &Tooth, t: f64) -> [f64; 3] {
        let revolutions = spindle.speed_rad_per_s() * t / std::f64::consts::TAU;
        let fed_m = cutter.feed_per_tooth_m * cutter.teeth.len() as f64 * revolutions;
        let [sin, cos] = Immersion::new(spindle.angle_rad(t) + tooth.angle_rad).outward;
        let radius_m = cutter.radius_m.unwrap_or(0.0);
        self.at(fed_m + radius_m * sin, radius_m * cos)
    }

    /// Solid fraction at a point of the workpiece times the relative cutting pressure: tangential, radial, axial. The
    /// point is given along feed and normal, m.
    pub(super) fn at(&self, x_m: f64, y_m: f64) -> [f64; 3] {
        let cell = LatticeCell::at(x_m / self.size_m, y_m / self.size_m);
        let solid = cell.interpolate(|i, j| f64::from(self.node_chance(i, j, 0) >= self.share));
        if self.strength == 0.0 || solid == 0.0 {
            return [solid; 3];
        }
        [1, 2, 3].map(|direction| {
            let sign = cell.interpolate(|i, j| {
                if self.node_chance(i, j, direction) < 0.5 {
                    -1.0
                } else {
                    1.0
                }
            });
            solid * (1.0 + self.strength * sign)
        })
    }

    /// A uniform random number in [0, 1) that depends only on the lattice node (i, j), the seed and the purpose: 0 for
    /// the pore, 1 to 3 for the three pressures.
    fn node_chance(&self, i: i64, j: i64, purpose: u64) -> f64 {
        let bits = hashed(self.seed ^ hashed((i as u64) ^ hashed((j as u64) ^ hashed(purpose))));
        // The upper 53 bits.
        (bits >> 11) as f64 / (1_u64 << 53) as f64
    }
}

/// A point between four lattice nodes: the lower left node and the interpolation weights of the right and upper ones.
struct LatticeCell {
    nodes: (i64, i64),
    weights: (f64, f64),
}

impl LatticeCell {
    fn at(x: f64, y: f64) -> Self {
        let (i, j) = (x.floor(), y.floor());
        Self {
            nodes: (i as i64, j as i64),
            weights: (smooth(x - i), smooth(y - j)),
        }
    }

    fn interpolate(&self, node: impl Fn(i64, i64) -> f64) -> f64 {
        let ((i, j), (u, v)) = (self.nodes, self.weights);
        let along = |j: i64| node(i, j) * (1.0 - u) + node(i + 1, j) * u;
        along(j) * (1.0 - v) + along(j + 1) * v
    }
}

/// The smooth step 6u⁵ − 15u⁴ + 10u³ from 0 to 1; its first and second derivatives are zero at both ends.
fn smooth(u: f64) -> f64 {
    u * u * u * (10.0 + u * (6.0 * u - 15.0))
}

/// One step of SplitMix64 (Steele, Lea and Flood, 2014): the increment, then the mixing of the bits.
fn hashed(bits: u64) -> u64 {
    let mut z = bits.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pore_fraction_is_as_set_and_nodes_are_uncorrelated() {
        for share in [0.0, 0.3, 0.7, 1.0] {
            let pores = Pores {
                share,
                size_m: 2e-4,
                strength: 0.0,
                seed: 9,
            };
            let at = |i: i64, j: i64| pores.at(2e-4 * i as f64, 2e-4 * j as f64)[0];
            let places = || (-150..150).flat_map(|i| (-150..150).map(move |j| (i, j)));
            let mean = places().map(|(i, j)| at(i, j)).sum::<f64>() / 90_000.0;
            // The standard deviation of the mean of 300² nodes is at most 0.5/300.
            assert!((mean - (1.0 - share)).abs() < 0.008, "{share}: {mean}");
            for (di, dj) in [(1, 0), (0, 1), (1, 1), (7, -3)] {
                let centred = |i, j| at(i, j) - (1.0 - share);
                let together = places()
                    .map(|(i, j)| centred(i, j) * centred(i + di, j + dj))
                    .sum::<f64>();
                assert!(
                    (together / 90_000.0).abs() < 0.004,
                    "{share} {di} {dj}: {together}"
                );
            }
        }
    }

    #[test]
    fn the_solid_fraction_between_nodes_is_smooth() {
        let pores = Pores {
            share: 0.5,
            size_m: 1e-3,
            strength: 0.0,
            seed: 2,
        };
        let h = 1e-7;
        for k in 0..4000 {
            let x = 1e-5 * f64::from(k) - 0.02;
            let [before, at, after] = [x - h, x, x + h].map(|x| pores.at(x, 0.3e-3)[0]);
            assert!((0.0..=1.0).contains(&at));
            // The smooth step has at most the slope 1.875 and the second derivative 5.8, per node distance.
            assert!((after - before).abs() < 2.0 * h / 1e-3 * 1.9);
            assert!((after - 2.0 * at + before).abs() < 6.0 * (h / 1e-3_f64).powi(2) + 1e-15);
        }
    }

    #[test]
    fn the_three_pressures_vary_independently_about_one() {
        let pores = Pores {
            share: 0.0,
            size_m: 1e-3,
            strength: 0.4,
            seed: 3,
        };
        let places = || (0..200).flat_map(|i| (0..200).map(move |j| (i, j)));
        let at = |(i, j): (i32, i32)| pores.at(1e-3 * f64::from(i), 1e-3 * f64::from(j));
        for (a, b) in [(0, 1), (1, 2), (0, 2)] {
            let mean = places().map(|place| at(place)[a]).sum::<f64>() / 4e4;
            let together = places()
                .map(|place| (at(place)[a] - 1.0) * (at(place)[b] - 1.0))
                .sum::<f64>()
                / 4e4;
            // Standard deviations over 200² nodes: 0.4/200 of the mean and 0.16/200 of the covariance.
            assert!(
                (mean - 1.0).abs() < 0.01 && together.abs() < 0.004,
                "{mean} {together}"
            );
        }
    }
}
