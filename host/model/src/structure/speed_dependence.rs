//! Modes of a structure that depend on the spindle speed, as those of a spindle whose bearings lose preload.

use num_complex::Complex64;

use super::Mode;
use crate::criteria::{LARGEST_PAIRED_RATIO, LEAST_PAIRED_MAC};

/// Modes of a structure at several spindle speeds, and the modes at any speed by interpolation.
///
/// Modes of neighbouring speeds are paired by their modal assurance criterion (MAC) and frequency. Between two speeds,
/// natural frequency, damping ratio and shapes of a pair lie on straight lines over the speed; beyond the lowest and
/// highest speed they are level. Of the free scale of a mode, right·c and left/c, the one is taken whose right shape has
/// the norm and the phase of its partner.
#[derive(Clone, Debug, PartialEq)]
pub struct SpeedDependence {
    /// Modes in the order of the first structure, by ascending speed.
    nodes: Vec<ModesAtSpeed>,
    /// Index of the first structure among the nodes.
    base: usize,
}

/// Modes of a structure at one spindle speed.
#[derive(Clone, Debug, PartialEq)]
pub struct ModesAtSpeed {
    /// Spindle speed, rev/min; 0 is standstill.
    pub rpm: f64,
    /// Modes of the structure at this speed.
    pub modes: Vec<Mode>,
}

/// Reason why modes at several speeds cannot be interpolated.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PairingError {
    /// Two structures hold at the same speed.
    #[error("two structures hold at {rpm} rev/min; one for each speed is needed")]
    SameSpeed {
        /// The speed, rev/min.
        rpm: f64,
    },
    /// The structures have different numbers of modes.
    #[error(
        "{found} modes at {rpm} rev/min, and {expected} at {other_rpm} rev/min; the same modes are needed at each speed"
    )]
    Count {
        /// Speed of the structure with the other number of modes, rev/min.
        rpm: f64,
        /// Its number of modes.
        found: usize,
        /// Neighbouring speed, rev/min.
        other_rpm: f64,
        /// Number of modes there.
        expected: usize,
    },
    /// A mode has no partner at the neighbouring speed.
    #[error(
        "the mode of {frequency_hz:.2} Hz at {rpm} rev/min has no partner at {other_rpm} rev/min: the nearest free one has {nearest_hz:.2} Hz and \
         a MAC of {mac:.2}; a MAC of {LEAST_PAIRED_MAC} or more and frequencies within a factor of {LARGEST_PAIRED_RATIO} are needed: \
         measure at a speed between, or give the structure of the speed at which you cut"
    )]
    Unpaired {
        /// Natural frequency of the mode, Hz.
        frequency_hz: f64,
        /// Its speed, rev/min.
        rpm: f64,
        /// Neighbouring speed, rev/min.
        other_rpm: f64,
        /// Natural frequency of the nearest mode there that has no partner, Hz.
        nearest_hz: f64,
        /// Modal assurance criterion of both.
        mac: f64,
    },
}

impl SpeedDependence {
    /// Pairs the modes of the first structure, `base`, with those of the others. At least one other is needed for a
    /// dependence.
    ///
    /// # Errors
    /// See [`PairingError`].
    pub fn new(base: ModesAtSpeed, others: Vec<ModesAtSpeed>) -> Result<Self, PairingError> {
        let base_rpm = base.rpm;
        let mut nodes: Vec<ModesAtSpeed> = std::iter::once(base).chain(others).collect();
        nodes.sort_by(|a, b| a.rpm.total_cmp(&b.rpm));
        if let Some(pair) = nodes.windows(2).find(|pair| pair[0].rpm == pair[1].rpm) {
            return Err(PairingError::SameSpeed { rpm: pair[0].rpm });
        }
        let base = nodes.iter().position(|node| node.rpm == base_rpm).unwrap_or(0);
        for index in base + 1..nodes.len() {
            nodes[index] = paired(&nodes[index - 1], &nodes[index])?;
        }
        for index in (0..base).rev() {
            nodes[index] = paired(&nodes[index + 1], &nodes[index])?;
        }
        Ok(Self { nodes, base })
    }

    /// Spindle speeds of the structures, rev/min, ascending.
    pub fn speeds_rpm(&self) -> Vec<f64> {
        self.nodes.iter().map(|node| node.rpm).collect()
    }

    /// Structures at the speeds other than that of the first one, by ascending speed.
    pub(crate) fn further(&self) -> impl Iterator<Item = &ModesAtSpeed> {
        let nodes = self.nodes.iter().enumerate();
        nodes
            .filter(|(index, _)| *index != self.base)
            .map(|(_, node)| node)
    }

    /// Modes at the spindle speed `rpm`, rev/min, of a machine whose modes at the speed of the first structure are `now`:
    /// frequencies and damping ratios change by the same factor as those of the first structure, shapes by the same
    /// difference. With the modes of the first structure itself they are the interpolated ones. Errors of the first
    /// structure thus hold at all speeds.
    pub fn at(&self, now: &[Mode], rpm: f64) -> Vec<Mode> {
        let first = &self.nodes[self.base].modes;
        let there = self.interpolated(rpm);
        now.iter()
            .zip(first.iter().zip(&there))
            .map(|(now, (first, there))| {
                let damping_ratio = if first.damping_ratio > 0.0 {
                    now.damping_ratio * there.damping_ratio / first.damping_ratio
                } else {
                    now.damping_ratio + there.damping_ratio
                };
                Mode {
                    frequency_hz: now.frequency_hz * there.frequency_hz / first.frequency_hz,
                    // A mode is not overdamped; a shifted ratio stays below 1 like that of a case.
                    damping_ratio: damping_ratio.min(1.0 - f64::EPSILON),
                    left: changed(&now.left, &first.left, &there.left),
                    right: changed(&now.right, &first.right, &there.right),
                }
            })
            .collect()
    }

    fn interpolated(&self, rpm: f64) -> Vec<Mode> {
        let above = self.nodes.partition_point(|node| node.rpm < rpm);
        let (Some(low), Some(high)) = (
            self.nodes.get(above.saturating_sub(1)),
            self.nodes.get(above).or(self.nodes.last()),
        ) else {
            return Vec::new();
        };
        let share = if high.rpm > low.rpm {
            (rpm - low.rpm) / (high.rpm - low.rpm)
        } else {
            0.0
        };
        let between = |a: f64, b: f64| a + (b - a) * share;
        let shape = |a: &[Complex64], b: &[Complex64]| -> Vec<Complex64> {
            a.iter().zip(b).map(|(a, b)| a + (b - a) * share).collect()
        };
        let pairs = low.modes.iter().zip(&high.modes);
        pairs
            .map(|(a, b)| Mode {
                frequency_hz: between(a.frequency_hz, b.frequency_hz),
                damping_ratio: between(a.damping_ratio, b.damping_ratio),
                left: shape(&a.left, &b.left),
                right: shape(&a.right, &b.right),
            })
            .collect()
    }
}

/// `now` plus the difference of `there` from `first`.
fn changed(now: &[Complex64], first: &[Complex64], there: &[Complex64]) -> Vec<Complex64> {
    let entries = now.iter().zip(first.iter().zip(there));
    entries
        .map(|(now, (first, there))| now + (there - first))
        .collect()
}

/// The modes of `other` in the order of those of `known`, each scaled as its partner.
fn paired(known: &ModesAtSpeed, other: &ModesAtSpeed) -> Result<ModesAtSpeed, PairingError> {
    if known.modes.len() != other.modes.len() {
        return Err(PairingError::Count {
            rpm: other.rpm,
            found: other.modes.len(),
            other_rpm: known.rpm,
            expected: known.modes.len(),
        });
    }
    // Pairs from the nearest on, by 1 − MAC plus the logarithm of the ratio of frequencies.
    let mut pairs: Vec<(usize, usize, f64, f64)> = Vec::new();
    for (i, a) in known.modes.iter().enumerate() {
        for (j, b) in other.modes.iter().enumerate() {
            let mac = mac(&a.right, &b.right).min(mac(&a.left, &b.left));
            pairs.push((i, j, mac, (b.frequency_hz / a.frequency_hz).ln().abs()));
        }
    }
    pairs.sort_by(|a, b| (1.0 - a.2 + a.3).total_cmp(&(1.0 - b.2 + b.3)));
    let mut partners: Vec<Option<usize>> = vec![None; known.modes.len()];
    let mut taken = vec![false; other.modes.len()];
    for &(i, j, mac, ratio) in &pairs {
        let is_near = mac >= LEAST_PAIRED_MAC && ratio <= LARGEST_PAIRED_RATIO.ln();
        if is_near && partners[i].is_none() && !taken[j] {
            partners[i] = Some(j);
            taken[j] = true;
        }
    }
    let mut modes = Vec::with_capacity(partners.len());
    for (i, partner) in partners.iter().enumerate() {
        match partner {
            Some(j) => modes.push(aligned(&known.modes[i], &other.modes[*j])),
            None => {
                let nearest = pairs.iter().find(|pair| pair.0 == i && !taken[pair.1]);
                return Err(PairingError::Unpaired {
                    frequency_hz: known.modes[i].frequency_hz,
                    rpm: known.rpm,
                    other_rpm: other.rpm,
                    nearest_hz: nearest.map_or(f64::NAN, |pair| other.modes[pair.1].frequency_hz),
                    mac: nearest.map_or(0.0, |pair| pair.2),
                });
            }
        }
    }
    Ok(ModesAtSpeed {
        rpm: other.rpm,
        modes,
    })
}

/// Modal assurance criterion |aᴴb|²/(|a|²·|b|²) of two shapes; 0 if one of them is zero.
fn mac(a: &[Complex64], b: &[Complex64]) -> f64 {
    let size = norm(a) * norm(b);
    if size > 0.0 {
        (product(a, b).norm() / size).powi(2)
    } else {
        0.0
    }
}

/// aᴴb.
fn product(a: &[Complex64], b: &[Complex64]) -> Complex64 {
    a.iter().zip(b).map(|(a, b)| a.conj() * b).sum()
}

fn norm(shape: &[Complex64]) -> f64 {
    shape.iter().map(Complex64::norm_sqr).sum::<f64>().sqrt()
}

/// The mode `other` with its right shape scaled to the norm of that of `known` and to a real positive product with it,
/// and its left shape scaled inversely: the residue right·leftᵀ stays.
fn aligned(known: &Mode, other: &Mode) -> Mode {
    let along = product(&known.right, &other.right);
    let factor = (along.conj() / along.norm()) * (norm(&known.right) / norm(&other.right));
    Mode {
        left: other.left.iter().map(|entry| entry / factor).collect(),
        right: other.right.iter().map(|entry| entry * factor).collect(),
        ..*other
    }
}

#[cfg(test)]
mod tests;
