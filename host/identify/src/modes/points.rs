//! Modes with shapes over named points, from a roving hammer or a roving sensor.

use num_complex::Complex64;
use quietcut_frf::{FrfTable, PointGroup};
use quietcut_model::structure::Direction;
use quietcut_numerics::statistics::chi_squared_quantile;

use super::folding_errors::MadeApart;
use super::model::ModalModel;
use super::point_direction::PointDirection;
use super::receptances::Receptances;
use super::{ModesError, Options, identify_coupled, shape};
use crate::criteria::SHIFT_PROBABILITY;

/// One entry of a mode shape over points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShapeEntry {
    /// Entry of the shape: with a drive point mass-normalized, 1/√kg, otherwise relative to the largest entry.
    pub value: Complex64,
    /// Standard deviation of its real and of its imaginary part; without a drive point that of the entry for a fixed
    /// largest one.
    pub std: [f64; 2],
}

/// A mode with its shape over points.
#[derive(Clone, Debug, PartialEq)]
pub struct PointMode {
    /// Natural frequency, Hz.
    pub frequency_hz: f64,
    /// Standard deviation of the natural frequency, Hz.
    pub frequency_std_hz: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Standard deviation of the damping ratio.
    pub damping_ratio_std: f64,
    /// The shape, in the order of [`PointModes::places`].
    pub shape: Vec<ShapeEntry>,
}

/// A natural frequency that differs between the recordings by more than its errors.
#[derive(Clone, Debug, PartialEq)]
pub struct FrequencyShift {
    /// Index of the mode.
    pub mode: usize,
    /// Index of the group with the lowest frequency, and the frequency with its standard deviation, Hz.
    pub lowest: (usize, [f64; 2]),
    /// Likewise the highest.
    pub highest: (usize, [f64; 2]),
}

/// Modes with shapes over points.
#[derive(Clone, Debug)]
pub struct PointModes {
    /// Directions at points to which the entries of the shapes belong: those of the forces if they are more (roving
    /// hammer), else those of the responses.
    pub places: Vec<PointDirection>,
    /// True if `places` are those of the forces.
    pub is_of_forces: bool,
    /// The places that are both driven and measured; without any the shapes are unscaled.
    pub drive_points: Vec<PointDirection>,
    /// The modes, by ascending frequency.
    pub modes: Vec<PointMode>,
    /// Natural frequencies that differ between the groups of recordings.
    pub shifts: Vec<FrequencyShift>,
    /// The fit: its shapes have one entry for each place of a force and of a response.
    pub model: ModalModel,
}

/// Identifies modes with shapes over points from receptances between them, in the band `band_hz`, Hz.
///
/// H_pq(s) = Σ_r Ψᴿ_pr Ψᴸ_qr/(s − λ_r) + conjugates, with p and q over directions at points, and common poles. A place
/// that is both driven and measured fixes the scale: reciprocal shapes are equal there. A mass-normalized shape is
/// φ = Ψ·√(2iω_d), since a real mode has the residue φ_p φ_q/(2iω_d).
///
/// # Errors
/// See [`ModesError`]; a receptance between a driven and a measured place is missing, or appears twice.
pub fn identify_points(
    groups: &[PointGroup],
    band_hz: Option<[f64; 2]>,
    options: &Options,
) -> Result<PointModes, ModesError> {
    let PlacedReceptances {
        data,
        responses,
        forces,
    } = PlacedReceptances::of(groups, band_hz)?;
    let mut model = identify_coupled(&data, options)?;
    let is_of_forces = forces.len() > responses.len();
    let apart = if is_of_forces {
        MadeApart::Forces
    } else {
        MadeApart::Responses
    };
    model.add_folding_errors(&data, apart);
    let places = if is_of_forces {
        forces.clone()
    } else {
        responses.clone()
    };
    let drive_points: Vec<PointDirection> = forces
        .iter()
        .filter(|place| responses.contains(place))
        .cloned()
        .collect();
    let modes = model
        .modes
        .iter()
        .map(|found| {
            let (entries, std) = if is_of_forces {
                (&found.mode.left, &found.left_std)
            } else {
                (&found.mode.right, &found.right_std)
            };
            let largest = entries
                .iter()
                .max_by(|a, b| a.norm().total_cmp(&b.norm()))
                .copied()
                .unwrap_or(Complex64::ONE);
            let scale = if drive_points.is_empty() {
                largest.inv()
            } else {
                (Complex64::new(0.0, 2.0 * found.mode.pole().im)).sqrt()
            };
            PointMode {
                frequency_hz: found.mode.frequency_hz,
                frequency_std_hz: found.frequency_std_hz,
                damping_ratio: found.mode.damping_ratio,
                damping_ratio_std: found.damping_ratio_std,
                shape: entries
                    .iter()
                    .zip(std)
                    .map(|(value, std)| scaled(*value, *std, scale))
                    .collect(),
            }
        })
        .collect();
    Ok(PointModes {
        shifts: shifts(groups, band_hz, options, &model),
        places,
        is_of_forces,
        drive_points,
        modes,
        model,
    })
}

/// Modal assurance criterion between the shapes of two modes over the places: |aᴴb|²/(aᴴa · bᴴb).
pub fn assurance(a: &PointMode, b: &PointMode) -> f64 {
    let values = |mode: &PointMode| mode.shape.iter().map(|entry| entry.value).collect::<Vec<_>>();
    shape::assurance(&values(a), &values(b))
}

/// The entry times `scale`; the standard deviations of real and imaginary part turn with it as if they were independent.
fn scaled(value: Complex64, std: [f64; 2], scale: Complex64) -> ShapeEntry {
    let turned = |re: f64, im: f64| (re * std[0]).hypot(im * std[1]);
    ShapeEntry {
        value: scale * value,
        std: [turned(scale.re, scale.im), turned(scale.im, scale.re)],
    }
}

/// Receptances between places as data of a modal fit, and the places.
struct PlacedReceptances {
    data: Receptances,
    responses: Vec<PointDirection>,
    forces: Vec<PointDirection>,
}

impl PlacedReceptances {
    fn of(groups: &[PointGroup], band_hz: Option<[f64; 2]>) -> Result<Self, ModesError> {
        let lines = common_lines(groups, band_hz);
        let (mut responses, mut forces): (Vec<PointDirection>, Vec<PointDirection>) =
            (Vec::new(), Vec::new());
        let (mut places, mut values) = (Vec::new(), Vec::new());
        let (mut deviation, mut folding) = (Vec::new(), Vec::new());
        for group in groups {
            let table = &group.measurement.table;
            let at = lines_of(table, &lines);
            for (index, entry) in table.entries().iter().enumerate() {
                let place = (
                    place_of(&mut responses, &group.points.sensor, entry.response),
                    place_of(&mut forces, &group.points.force, entry.force),
                );
                if places.contains(&place) {
                    return Err(ModesError::Data(format!(
                        "the receptance of {} by a force at {} is measured twice",
                        responses[place.0], forces[place.1]
                    )));
                }
                places.push(place);
                values.push(at.iter().map(|&line| entry.receptance[line]).collect::<Vec<_>>());
                let of_entry = |all: &Vec<f64>| at.iter().map(|&line| all[line]).collect();
                folding.push(entry.folding.as_ref().map_or_else(Vec::new, of_entry));
                deviation.push(
                    at.iter()
                        .map(|&line| group.measurement.deviation[index][line])
                        .collect::<Vec<_>>(),
                );
            }
        }
        for (p, response) in responses.iter().enumerate() {
            for (q, force) in forces.iter().enumerate() {
                if !places.contains(&(p, q)) {
                    return Err(ModesError::Data(format!(
                        "the receptance of {response} by a force at {force} is missing: either one sensor stays and the hammer moves, or one point is \
                         driven and the sensor moves; leave the recordings of the other kind out"
                    )));
                }
            }
        }
        let has_deviation = groups
            .iter()
            .all(|group| group.measurement.has_deviation.iter().all(|has| *has));
        let mut data = Receptances::between_places(
            lines,
            [&responses, &forces],
            places,
            values,
            has_deviation.then_some(deviation),
        )?;
        data.folding = folding;
        Ok(Self {
            data,
            responses,
            forces,
        })
    }
}

/// Frequencies of the first group within the band, above 0 Hz, that all groups have, Hz.
fn common_lines(groups: &[PointGroup], band_hz: Option<[f64; 2]>) -> Vec<f64> {
    let [from_hz, to_hz] = band_hz.unwrap_or([0.0, f64::INFINITY]);
    let Some((first, others)) = groups.split_first() else {
        return Vec::new();
    };
    let is_common = |hertz: &f64| {
        *hertz > 0.0
            && (from_hz..=to_hz).contains(hertz)
            && others
                .iter()
                .all(|group| line_at(&group.measurement.table, *hertz).is_some())
    };
    let lines = first.measurement.table.frequency_hz().iter().copied();
    lines.filter(|hertz| is_common(hertz)).collect()
}

/// Index of the line of a table at a frequency, to within rounding.
fn line_at(table: &FrfTable, hertz: f64) -> Option<usize> {
    let lines = table.frequency_hz();
    let at = lines.partition_point(|line| *line < hertz * (1.0 - 1e-9));
    lines
        .get(at)
        .is_some_and(|line| *line <= hertz * (1.0 + 1e-9))
        .then_some(at)
}

fn lines_of(table: &FrfTable, lines: &[f64]) -> Vec<usize> {
    lines.iter().filter_map(|hertz| line_at(table, *hertz)).collect()
}

fn place_of(places: &mut Vec<PointDirection>, point: &str, direction: Direction) -> usize {
    let place = PointDirection {
        point: point.to_owned(),
        direction,
    };
    places
        .iter()
        .position(|known| *known == place)
        .unwrap_or_else(|| {
            places.push(place);
            places.len() - 1
        })
}

/// Largest relative distance of the natural frequency that one group of recordings has by itself from that of all. A choice: a
/// sensor that shifts a mode by more is no small one, and neighbouring modes of a machine are seldom closer.
const OWN_MODE: f64 = 0.03;

/// Natural frequencies that differ between the groups, each of which is identified by itself. A group counts if it has exactly one
/// mode within [`OWN_MODE`].
fn shifts(
    groups: &[PointGroup],
    band_hz: Option<[f64; 2]>,
    options: &Options,
    model: &ModalModel,
) -> Vec<FrequencyShift> {
    let own = |group: &PointGroup| -> Vec<[f64; 2]> {
        let placed = PlacedReceptances::of(std::slice::from_ref(group), band_hz);
        let found = placed.and_then(|placed| identify_coupled(&placed.data, options));
        found.map_or_else(
            |_| Vec::new(),
            |own| {
                let modes = own.modes.iter();
                modes
                    .map(|found| [found.mode.frequency_hz, found.frequency_std_hz])
                    .collect()
            },
        )
    };
    let of_groups: Vec<Vec<[f64; 2]>> = groups.iter().map(own).collect();
    let mut shifts: Vec<FrequencyShift> = Vec::new();
    for (mode, found) in model.modes.iter().enumerate() {
        let hertz = found.mode.frequency_hz;
        let is_near = |own: &&[f64; 2]| (own[0] / hertz - 1.0).abs() <= OWN_MODE;
        let near: Vec<(usize, [f64; 2])> = of_groups
            .iter()
            .enumerate()
            .filter_map(|(group, own)| {
                let mut near = own.iter().filter(is_near);
                let only = near.next().filter(|_| near.next().is_none())?;
                Some((group, *only))
            })
            .collect();
        // Where the frequency shifts, the fit of all recordings may have two modes for one.
        let is_known = |new: &FrequencyShift| {
            let same = |old: &FrequencyShift| (old.lowest, old.highest) == (new.lowest, new.highest);
            shifts.iter().any(same)
        };
        if let Some(new) = shift(mode, &near).filter(|new| !is_known(new)) {
            shifts.push(new);
        }
    }
    shifts
}

/// The shift of a mode with the given frequencies and standard deviations, Hz, by group; `None` if they agree.
fn shift(mode: usize, found: &[(usize, [f64; 2])]) -> Option<FrequencyShift> {
    let freedoms = found.len().checked_sub(1).filter(|freedoms| *freedoms > 0)?;
    let weight = |std: f64| std.max(f64::MIN_POSITIVE).powi(-2);
    let weights: f64 = found.iter().map(|(_, [_, std])| weight(*std)).sum();
    let mean = found
        .iter()
        .map(|(_, [value, std])| weight(*std) * value)
        .sum::<f64>()
        / weights;
    let deviates = |value: f64, std: f64| (value - mean).powi(2) * weight(std);
    let chi_squared: f64 = found.iter().map(|(_, [value, std])| deviates(*value, *std)).sum();
    if chi_squared <= chi_squared_quantile(SHIFT_PROBABILITY, freedoms as f64) {
        return None;
    }
    // Where a mode hardly moves, its frequency is not known: only those that deviate from the mean are named.
    let sure = || {
        found
            .iter()
            .filter(|(_, [value, std])| deviates(*value, *std) > chi_squared_quantile(0.9, 1.0))
    };
    let by_frequency = |a: &&(usize, [f64; 2]), b: &&(usize, [f64; 2])| a.1[0].total_cmp(&b.1[0]);
    Some(FrequencyShift {
        mode,
        lowest: *sure().min_by(by_frequency)?,
        highest: *sure().max_by(by_frequency)?,
    })
}
