//! Ports of the cut of a forced problem with its directional coefficients, and the parts of a tooth period in which they are
//! smooth.

use nalgebra::Vector3;

use super::coefficients::{Coefficients, Smoothing};
use super::forced::ForcedProblem;
use super::periodic_orbit::OrbitError;
use quietcut_model::milling::Averaged;

/// Chip normal and force per chip thickness and depth of one port of the cut: of a tooth, or of one direction of the
/// averaged coefficients.
pub(super) struct Port {
    pub(super) normal: Vector3<f64>,
    pub(super) force: Vector3<f64>,
}

/// Part of a tooth period in which the coefficients are smooth enough for one element of the mesh, or several equal ones.
pub(super) struct Part {
    /// Phase of the tooth period, rad.
    pub(super) from: f64,
    pub(super) to: f64,
    /// Number of ports.
    pub(super) ports: usize,
}

/// Least width of a smooth entry and exit, rad. A choice: limits then differ from the exact ones by less than 1e-6 of
/// themselves, and the mesh has five times as many points.
const WIDTH_MIN: f64 = 1e-3;

/// Distance of the first point of the mesh from entry or exit, in widths ε; each next one is twice as far. A choice: tanh has
/// its poles at a distance of π/2 widths, so that nine Gauss nodes between two points err by 1e-9.
const FIRST_POINT: f64 = 2.0;

impl ForcedProblem {
    /// The same problem with other directional coefficients.
    ///
    /// # Errors
    /// The problem has a feature that smoothed or averaged coefficients do not cover.
    pub fn with_coefficients(mut self, coefficients: Coefficients) -> Result<Self, OrbitError> {
        let is_too_narrow = |smoothing: Smoothing| smoothing.width < WIDTH_MIN;
        let what = if coefficients == Coefficients::Exact {
            None
        } else if matches!(coefficients, Coefficients::Smoothed(smoothing) if is_too_narrow(smoothing)) {
            Some(
                "an entry smoothed over less than 0.001 rad, whose limits differ from the exact ones by less than 1e-6; use the exact coefficients",
            )
        } else if self.is_over_revolution() {
            Some(
                "smoothed or averaged coefficients of teeth with unequal pitch or runout; leave out runout and unequal pitch",
            )
        } else if self.chip_exponent().is_some() {
            Some("smoothed or averaged coefficients with extension.force-exponent; leave it out")
        } else if self.linear.process.axial_depth_modulation {
            Some("smoothed or averaged coefficients with axial-depth modulation; leave it out")
        } else if self.damping_per_depth([0.0].into_iter(), 1.0).is_some() {
            Some("smoothed or averaged coefficients with process damping; leave it out")
        } else {
            None
        };
        match what {
            Some(what) => Err(OrbitError::NotCovered { what }),
            None => {
                self.coefficients = coefficients;
                Ok(self)
            }
        }
    }

    fn averaged(&self) -> Averaged {
        let process = &self.linear.process;
        process
            .force
            .averaged(&process.engagement, process.feed_per_tooth_m)
    }

    /// Share of a tooth that cuts at an immersion angle, rad.
    pub(super) fn share(&self, angle: f64) -> f64 {
        match self.coefficients {
            Coefficients::Smoothed(smoothing) => smoothing.share(&self.linear.process.engagement, angle),
            Coefficients::Exact | Coefficients::Averaged => 1.0,
        }
    }

    /// A port of the cut at a phase of the tooth period, rad.
    pub(super) fn port(&self, port: usize, phase: f64) -> Port {
        let process = &self.linear.process;
        if self.coefficients == Coefficients::Averaged {
            let normal = Vector3::from_fn(|axis, _| if axis == port { 1.0 } else { 0.0 });
            let force = self.averaged().directional.column(port).into_owned();
            return Port { normal, force };
        }
        let angle = process.engagement.angle(port, phase);
        Port {
            normal: process.force.normal.at(angle),
            force: process.force.cutting.at(angle) * (self.chip_slope(angle) * self.share(angle)),
        }
    }

    /// Force per axial depth of the averaged coefficients, N/m; `None` with others.
    pub(super) fn averaged_force(&self) -> Option<Vector3<f64>> {
        (self.coefficients == Coefficients::Averaged).then(|| self.averaged().forced)
    }

    /// Parts of the tooth period in which the coefficients are smooth, in order of the phase.
    pub(super) fn parts(&self) -> Vec<Part> {
        let engagement = &self.linear.process.engagement;
        let smoothing = match self.coefficients {
            Coefficients::Exact => {
                let exact = engagement.subintervals().into_iter();
                return exact
                    .map(|at| Part {
                        from: at.from,
                        to: at.to,
                        ports: at.teeth,
                    })
                    .collect();
            }
            Coefficients::Averaged => {
                return vec![Part {
                    from: 0.0,
                    to: engagement.pitch,
                    ports: 3,
                }];
            }
            Coefficients::Smoothed(smoothing) => smoothing,
        };
        let pitch = engagement.pitch;
        // Phases at which some tooth enters or leaves, also beyond both ends of the period.
        let centres: Vec<f64> = [engagement.start, engagement.exit]
            .into_iter()
            .flat_map(|edge| {
                [-1.0, 0.0, 1.0, 2.0].map(|k| (edge - engagement.start).rem_euclid(pitch) + k * pitch)
            })
            .collect();
        let mut points = vec![0.0, pitch];
        for centre in centres {
            points.push(centre);
            let mut distance = FIRST_POINT * smoothing.width;
            while distance < 2.0 * pitch {
                points.extend([centre - distance, centre + distance]);
                distance *= 2.0;
            }
        }
        points.retain(|point| (0.0..=pitch).contains(point));
        points.sort_by(f64::total_cmp);
        points.dedup_by(|next, last| *next - *last < 1e-9 * pitch);
        points
            .windows(2)
            .map(|pair| Part {
                from: pair[0],
                to: pair[1],
                ports: self.linear.teeth,
            })
            .collect()
    }
}
