//! The milling problem described by its receptances.

use std::sync::{Arc, OnceLock};

use nalgebra::Matrix3;
use num_complex::Complex64;

use super::fitted_structure::FittedStructure;
use crate::criteria::{PEAK_SHARE, UNDAMPED};
use crate::error::StabilityError;
use crate::problem::linear::{CubicTerms, Problem, cutting};
use crate::process::treatment::Treated;
use quietcut_frf::{FrfTable, Interpolation};
use quietcut_model::case::Case;
use quietcut_model::milling::Process;
use quietcut_model::structure::FirstOrder;

/// Milling problem in the frequency domain: receptances and cutting process, in feed, normal and axial direction.
#[derive(Clone, Debug)]
pub struct FrequencyProblem {
    receptance: Receptance,
    /// Structure fitted to the table of receptances, or `None` if there is none; empty until it is needed.
    fitted: OnceLock<Option<Arc<FittedStructure>>>,
    /// The cutting process.
    pub process: Process,
    /// Number of teeth.
    pub teeth: usize,
}

/// Source of the receptance matrix H(s): modelled structure, or table of measured receptances.
#[derive(Clone, Debug)]
enum Receptance {
    /// Modelled structure, with its poles.
    Model(FirstOrder, Vec<Complex64>),
    /// Interpolated table of measured receptances.
    Table(Interpolation),
}

/// Resonance: a frequency, rad/s, near which receptances change fast, and its half bandwidth, rad/s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Resonance {
    pub(crate) omega: f64,
    pub(crate) width: f64,
}

impl FrequencyProblem {
    /// Builds the frequency-domain problem of a case with a modelled structure.
    ///
    /// # Errors
    /// As [`Problem::new`] and [`FrequencyProblem::of_model`].
    pub fn new(case: &Case, cubic: CubicTerms) -> Result<Self, StabilityError> {
        Self::of_model(&Problem::new(case, cubic)?)
    }

    /// Builds the frequency-domain problem of a modelled structure.
    ///
    /// # Errors
    /// A mode has zero, almost zero or negative damping, so that its receptance is infinite or meaningless.
    pub fn of_model(problem: &Problem) -> Result<Self, StabilityError> {
        let poles = problem.structure.poles();
        if let Some(pole) = poles.iter().find(|pole| pole.re >= -UNDAMPED * pole.norm()) {
            return Err(StabilityError::Undamped {
                frequency_hz: pole.im.abs() / std::f64::consts::TAU,
            });
        }
        Ok(Self {
            receptance: Receptance::Model(problem.structure.clone(), poles),
            fitted: OnceLock::new(),
            process: problem.process,
            teeth: problem.teeth,
        })
    }

    /// Builds the problem of a case with measured receptances in place of its structure; the case needs no structure.
    ///
    /// # Errors
    /// The case lacks a section or has a feature that the equations do not cover, or the table has fewer than four
    /// lines.
    pub fn of_table(case: &Case, table: &FrfTable) -> Result<Self, StabilityError> {
        let (process, teeth) = cutting(case, Treated::LinearProcess)?;
        let interpolation = Interpolation::new(table)?.rotated(case.cut()?.feed_direction_deg);
        Ok(Self {
            receptance: Receptance::Table(interpolation),
            fitted: OnceLock::new(),
            process,
            teeth,
        })
    }

    /// Tooth period, s.
    pub(crate) fn tooth_period_s(&self, rpm: f64) -> f64 {
        60.0 / (rpm * self.teeth as f64)
    }

    /// Receptance matrix H(s), m/N; rows are displacements, columns forces; s in rad/s. `None` if s is a pole of the
    /// modelled structure.
    pub(crate) fn transfer(&self, s: Complex64) -> Option<Matrix3<Complex64>> {
        match &self.receptance {
            Receptance::Model(structure, _) => structure.transfer(s),
            Receptance::Table(interpolation) => {
                Some(interpolation.at(s / Complex64::new(0.0, std::f64::consts::TAU)))
            }
        }
    }

    /// Number of poles of the modelled structure with a real part above `sigma` (1/s), conjugates included; 0 for a
    /// table of receptances, whose poles are not known.
    pub(crate) fn poles_right_of(&self, sigma: f64) -> i32 {
        self.poles().iter().map(|pole| i32::from(pole.re > sigma)).sum()
    }

    /// Poles of the modelled structure, 1/s; empty for a table of receptances.
    pub(crate) fn poles(&self) -> &[Complex64] {
        match &self.receptance {
            Receptance::Model(_, poles) => poles,
            Receptance::Table(_) => &[],
        }
    }

    /// Frequency-domain problem with every second line of its FRF table and the last line only; `None` for a modelled
    /// structure, or if too few lines remain.
    pub(crate) fn thinned(&self) -> Option<Self> {
        let Receptance::Table(interpolation) = &self.receptance else {
            return None;
        };
        Some(Self {
            receptance: Receptance::Table(interpolation.thinned()?),
            fitted: OnceLock::new(),
            ..self.clone()
        })
    }

    /// Structure fitted to the table of receptances; `None` for a modelled structure, with axial-depth modulation, or if
    /// no structure fits the table.
    pub(crate) fn fitted(&self) -> Option<&FittedStructure> {
        let Receptance::Table(interpolation) = &self.receptance else {
            return None;
        };
        if self.process.axial_depth_modulation {
            return None;
        }
        let fitted = self
            .fitted
            .get_or_init(|| FittedStructure::of_table(interpolation).map(Arc::new));
        fitted.as_deref()
    }

    /// Receptance matrix of the table, m/N, at a complex frequency, Hz; zero for a modelled structure.
    pub(crate) fn table_at(&self, frequency_hz: Complex64) -> Matrix3<Complex64> {
        match &self.receptance {
            Receptance::Model(..) => Matrix3::zeros(),
            Receptance::Table(interpolation) => interpolation.at(frequency_hz),
        }
    }

    /// Errors |ΔH| of the table by aliasing, m/N, at a frequency, Hz; zero for a modelled structure.
    pub(crate) fn folding_at(&self, frequency_hz: f64) -> Matrix3<f64> {
        match &self.receptance {
            Receptance::Model(..) => Matrix3::zeros(),
            Receptance::Table(interpolation) => interpolation.folding(frequency_hz),
        }
    }

    /// Frequency range of the measured receptances, Hz; `None` for a modelled structure.
    pub(crate) fn band_hz(&self) -> Option<(f64, f64)> {
        match &self.receptance {
            Receptance::Model(..) => None,
            Receptance::Table(interpolation) => Some(interpolation.band_hz()),
        }
    }

    /// Refuses a result at a frequency outside the range of the measured receptances.
    ///
    /// # Errors
    /// The vibration at that speed and depth has a frequency outside the table.
    pub(crate) fn check_band(
        &self,
        frequency_hz: Option<f64>,
        rpm: f64,
        depth_mm: f64,
    ) -> Result<(), StabilityError> {
        let (Some((first_hz, last_hz)), Some(frequency_hz)) = (self.band_hz(), frequency_hz) else {
            return Ok(());
        };
        if (first_hz..=last_hz).contains(&frequency_hz) {
            return Ok(());
        }
        Err(StabilityError::NotMeasured {
            rpm,
            depth_mm,
            frequency_hz,
            first_hz,
            last_hz,
        })
    }

    /// True for each direction (feed, normal, axial) in which the tool is compliant.
    pub(crate) fn moves(&self) -> [bool; 3] {
        std::array::from_fn(|axis| match &self.receptance {
            Receptance::Model(structure, _) => structure.c.row(axis).iter().any(|&entry| entry != 0.0),
            Receptance::Table(interpolation) => interpolation
                .lines()
                .iter()
                .any(|line| line.row(axis).iter().any(|&entry| entry != Complex64::ZERO)),
        })
    }

    /// Resonances: poles of a modelled structure with Im ≥ 0, or peaks of a table of receptances.
    pub(crate) fn resonances(&self) -> Vec<Resonance> {
        match &self.receptance {
            Receptance::Model(_, poles) => poles
                .iter()
                .filter(|pole| pole.im >= 0.0)
                .map(|pole| Resonance {
                    omega: pole.im,
                    width: -pole.re,
                })
                .collect(),
            Receptance::Table(interpolation) => peaks(interpolation),
        }
    }

    /// Frequencies, rad/s, that resolve the receptances H: the lines of a table; empty for a modelled structure.
    pub(crate) fn lines(&self) -> Vec<f64> {
        match &self.receptance {
            Receptance::Model(..) => Vec::new(),
            Receptance::Table(interpolation) => {
                let lines = interpolation.frequency_hz().iter();
                lines.map(|f| f * std::f64::consts::TAU).collect()
            }
        }
    }
}

/// Peaks of the norm of the receptance matrix in a table, of at least [`PEAK_SHARE`] times its largest norm, with their
/// half bandwidth.
///
/// Peaks due to noise are harmless and only cost computing time.
fn peaks(interpolation: &Interpolation) -> Vec<Resonance> {
    const RAD: f64 = std::f64::consts::TAU;
    let size: Vec<f64> = interpolation.lines().iter().map(|line| line.norm()).collect();
    let frequency_hz = interpolation.frequency_hz();
    let highest = size.iter().copied().fold(0.0, f64::max);
    let mut peaks = Vec::new();
    for index in 1..size.len().saturating_sub(1) {
        let peak = size[index];
        if peak < size[index - 1] || peak <= size[index + 1] || peak < PEAK_SHARE * highest {
            continue;
        }
        // Distance, on one side of the resonance, from the peak to the frequency at which the receptance falls to 1/√2
        // of it, or to the foot of the next peak.
        let falls = |range: &mut dyn Iterator<Item = usize>| {
            let mut last = index;
            for other in range {
                if size[other] > size[last] || size[last] < peak * std::f64::consts::FRAC_1_SQRT_2 {
                    break;
                }
                last = other;
            }
            (frequency_hz[last] - frequency_hz[index]).abs()
        };
        let (below, above) = (falls(&mut (0..index).rev()), falls(&mut (index + 1..size.len())));
        peaks.push(Resonance {
            omega: RAD * frequency_hz[index],
            width: RAD * below.min(above),
        });
    }
    peaks
}
