//! The effects that may act in cuts, at all their places, with their widths before records are seen.
//!
//! A width is the size that an effect of this kind commonly has: a coordinate of one. What is proportional to a quantity
//! of the case is given as a share of it; restoring forces are compared with the linear spring or damper along the motion
//! of the baseline, so that widths do not depend on units or size of a machine.

use super::candidate::{Candidate, Coordinate};
use super::fit::Fit;
use super::record::ReducedCut;
use super::restoring_candidates::{
    Along, DAMPING_RATIO, FAINT, of_axis, of_coupling, of_missing_mode, of_restoring_force,
};
use crate::baseline::{Baseline, pickup_of};
use crate::candidates::cause::Location;
use quietcut_model::case::Case;
use quietcut_model::effects::EffectName;
use quietcut_model::milling::Tool;
use quietcut_model::structure::Form;
use quietcut_recording::Quantity;

/// Mass, stiffness and damping, and cutting coefficients, relative: a case of another posture, tool or material.
const PARAMETER: f64 = 0.3;
/// Exponent of the chip thickness, below 1 (Kienzle: 0.65 to 0.9).
const EXPONENT: f64 = 0.2;
/// Logarithm of the reference chip of an exponent over the feed per tooth.
const REFERENCE_CHIP: f64 = 0.5;
/// Runout, µm (tool holders: 3 to 20 µm).
const RUNOUT_UM: f64 = 10.0;
/// Growth of the forces by wear, and change of the stiffness by heat and posture, over a record.
const WEAR: f64 = 0.2;
const DRIFT: f64 = 0.1;
/// Friction coefficient of the flank of a tooth (dry steel and carbide: 0.2 to 0.5).
const FLANK_FRICTION: f64 = 0.3;
/// Error of the gain of a sensor.
const GAIN: f64 = 0.1;
/// Delay of a channel, in samples.
const DELAY_SAMPLES: f64 = 3.0;
/// Sensitivity across the axis of a sensor (data sheets: up to 5 %).
const CROSS_AXIS: f64 = 0.05;
/// Motion at a sensor over that at the tool tip, in a mode.
const OFFSET: f64 = 0.3;

/// All candidates for these records.
pub(crate) fn all(baseline: &Baseline<'_>, records: &[ReducedCut], fit: &Fit) -> Vec<Candidate> {
    let along: Vec<Along> = baseline
        .axes
        .iter()
        .filter_map(|axis| of_axis(baseline, fit, *axis))
        .collect();
    let mut all = Vec::new();
    of_linear_structure(baseline, &along, &mut all);
    for along in &along {
        of_restoring_force(*along, &mut all);
        of_missing_mode(*along, records, &mut all);
    }
    of_coupling(&along, &mut all);
    of_time(records, &mut all);
    of_process(baseline, records, &mut all);
    of_sensors(baseline, records, &mut all);
    all
}

fn of_linear_structure(baseline: &Baseline<'_>, along: &[Along], all: &mut Vec<Candidate>) {
    let mut places = vec![Location::Everywhere];
    if baseline.mode_count() == 0 && along.len() > 1 {
        places.extend(along.iter().map(|along| Location::Axis(along.axis)));
    }
    let effects = [
        (EffectName::Mass, "mass_kg"),
        (EffectName::Stiffness, "stiffness_n_per_m"),
        (EffectName::Damping, "damping_ns_per_m"),
    ];
    for (effect, key) in effects {
        for place in &places {
            let of = |z: &[f64]| vec![("relative_change", (PARAMETER * z[0]).exp() - 1.0)];
            let candidate = match entry(baseline.case, effect, place) {
                Some(known) if known > 0.0 => {
                    let of = move |z: &[f64]| vec![(key, known * (PARAMETER * z[0]).exp())];
                    let own = place.clone();
                    let at = move |case: &Case| Some(vec![logarithm(entry(case, effect, &own)? / known)?]);
                    Candidate::new(effect, place.clone(), vec![Coordinate::FREE], of).setting(at)
                }
                _ => Candidate::new(effect, place.clone(), vec![Coordinate::FREE], of),
            };
            all.push(candidate);
        }
    }
}

/// Coordinate of a factor; `None` if that is not positive.
fn logarithm(factor: f64) -> Option<f64> {
    (factor > 0.0).then(|| factor.ln() / PARAMETER)
}

/// Diagonal entry of the matrix of an effect along the direction of a place; `None` for the whole structure, or one that
/// is not given by matrices.
fn entry(case: &Case, effect: EffectName, place: &Location) -> Option<f64> {
    let structure = case.structure.as_ref()?;
    let Form::Matrices(matrices) = &structure.form else {
        return None;
    };
    let direction = place.direction()?;
    let index = structure
        .directions
        .iter()
        .position(|other| *other == direction)?;
    let matrix = match effect {
        EffectName::Mass => &matrices.mass,
        EffectName::Stiffness => &matrices.stiffness,
        _ => &matrices.damping,
    };
    Some(matrix[(index, index)])
}

/// Wear and drift, by their change over the longest record.
fn of_time(records: &[ReducedCut], all: &mut Vec<Candidate>) {
    let longest_s = records
        .iter()
        .filter_map(|record| record.orders.trend.as_ref())
        .map(|trend| 12.0_f64.sqrt() * trend.scale_s)
        .fold(0.0, f64::max);
    if longest_s == 0.0 {
        return;
    }
    for (effect, change) in [(EffectName::Wear, WEAR), (EffectName::Drift, DRIFT)] {
        let rate = move |z: &[f64]| vec![("relative_rate_per_s", change * z[0] / longest_s)];
        all.push(Candidate::new(
            effect,
            Location::Everywhere,
            vec![Coordinate::FREE],
            rate,
        ));
    }
}

fn of_process(baseline: &Baseline<'_>, records: &[ReducedCut], all: &mut Vec<Candidate>) {
    let (Ok(&material), Ok(tool)) = (baseline.case.material(), baseline.case.tool()) else {
        return;
    };
    let feeds: Vec<f64> = records
        .iter()
        .map(|record| record.conditions.cut.feed_per_tooth_mm)
        .collect();
    let feed_mm = feeds.iter().sum::<f64>() / feeds.len().max(1) as f64;
    let factor = move |z: &[f64]| {
        let factor = (PARAMETER * z[0]).exp();
        vec![
            ("ktc_mpa", material.ktc_mpa * factor),
            ("krc_mpa", material.krc_mpa * factor),
            ("kac_mpa", material.kac_mpa * factor),
        ]
    };
    let at = move |case: &Case| {
        let other = case.material().ok()?;
        Some(vec![logarithm(other.ktc_mpa / material.ktc_mpa)?])
    };
    all.push(
        Candidate::new(
            EffectName::ForceCoefficients,
            Location::Everywhere,
            vec![Coordinate::FREE],
            factor,
        )
        .setting(at),
    );
    let sees_axial = tool.edge_angle_deg != 90.0 || material.kac_mpa != 0.0;
    let components = if sees_axial { 3 } else { 2 };
    let each = move |z: &[f64]| {
        let own = |mpa: f64, z: f64| {
            if mpa == 0.0 {
                PARAMETER * material.ktc_mpa * z
            } else {
                mpa * (PARAMETER * z).exp()
            }
        };
        let all = [
            ("ktc_mpa", own(material.ktc_mpa, z[0])),
            ("krc_mpa", own(material.krc_mpa, z[1])),
            ("kac_mpa", own(material.kac_mpa, z.get(2).copied().unwrap_or(0.0))),
        ];
        all[..components].to_vec()
    };
    let at = move |case: &Case| {
        let other = case.material().ok()?;
        let of = |mpa: f64, known_mpa: f64| {
            if known_mpa == 0.0 {
                Some(mpa / (PARAMETER * material.ktc_mpa))
            } else {
                logarithm(mpa / known_mpa)
            }
        };
        let all = [
            of(other.ktc_mpa, material.ktc_mpa)?,
            of(other.krc_mpa, material.krc_mpa)?,
            of(other.kac_mpa, material.kac_mpa)?,
        ];
        Some(all[..components].to_vec())
    };
    all.push(
        Candidate::new(
            EffectName::ForceCoefficients,
            Location::Everywhere,
            vec![Coordinate::FREE; components],
            each,
        )
        .setting(at),
    );
    let width = PARAMETER * material.ktc_mpa * feed_mm;
    let edge = move |z: &[f64]| {
        let all = [
            ("kte_n_per_mm", material.kte_n_per_mm + width * z[0]),
            ("kre_n_per_mm", material.kre_n_per_mm + width * z[1]),
            (
                "kae_n_per_mm",
                material.kae_n_per_mm + width * z.get(2).copied().unwrap_or(0.0),
            ),
        ];
        all[..components].to_vec()
    };
    let at = move |case: &Case| {
        let other = case.material().ok()?;
        let all = [
            other.kte_n_per_mm - material.kte_n_per_mm,
            other.kre_n_per_mm - material.kre_n_per_mm,
            other.kae_n_per_mm - material.kae_n_per_mm,
        ];
        Some(all[..components].iter().map(|change| change / width).collect())
    };
    all.push(
        Candidate::new(
            EffectName::EdgeForce,
            Location::Everywhere,
            vec![Coordinate::FREE; components],
            edge,
        )
        .setting(at),
    );
    let power = move |z: &[f64]| {
        vec![
            ("exponent", (-EXPONENT * z[0]).exp()),
            ("reference_chip_mm", feed_mm * (REFERENCE_CHIP * z[1]).exp()),
        ]
    };
    all.push(Candidate::new(
        EffectName::ForceExponent,
        Location::Everywhere,
        vec![Coordinate::FREE; 2],
        power,
    ));
    of_tool(baseline, all);
    if tool.diameter_mm.is_some() {
        of_process_damping(baseline, records, all);
    }
    if baseline.axes.contains(&2) {
        let no_parameters = |_: &[f64]| Vec::new();
        all.push(Candidate::new(
            EffectName::AxialDepthModulation,
            Location::Everywhere,
            Vec::new(),
            no_parameters,
        ));
    }
}

/// Runout: cosine and sine of the offset, from that of the case.
fn of_tool(baseline: &Baseline<'_>, all: &mut Vec<Candidate>) {
    let Ok(tool) = baseline.case.tool() else { return };
    if tool.teeth < 2 {
        return;
    }
    let offset_um = |tool: &Tool| {
        let runout = tool.runout.as_ref();
        runout.map_or([0.0; 2], |runout| {
            let angle_rad = runout.angle_deg.to_radians();
            [
                runout.offset_um * angle_rad.cos(),
                runout.offset_um * angle_rad.sin(),
            ]
        })
    };
    let known_um = offset_um(tool);
    let offset = move |z: &[f64]| {
        let [x, y] = std::array::from_fn(|index| known_um[index] + RUNOUT_UM * z[index]);
        vec![("runout_um", x.hypot(y)), ("angle_deg", y.atan2(x).to_degrees())]
    };
    let at = move |case: &Case| {
        let other_um = offset_um(case.tool().ok()?);
        let of = |(other, known): (f64, f64)| (other - known) / RUNOUT_UM;
        Some(other_um.into_iter().zip(known_um).map(of).collect())
    };
    all.push(
        Candidate::new(
            EffectName::Runout,
            Location::Everywhere,
            vec![Coordinate::FREE; 2],
            offset,
        )
        .setting(at),
    );
}

/// The width of process damping is that of a force along the chip as large as that of a structural damper of the ratio
/// [`DAMPING_RATIO`], at the mean cutting speed.
fn of_process_damping(baseline: &Baseline<'_>, records: &[ReducedCut], all: &mut Vec<Candidate>) {
    let Ok(tool) = baseline.case.tool() else { return };
    let Some(diameter_mm) = tool.diameter_mm else {
        return;
    };
    let speed = |record: &ReducedCut| {
        std::f64::consts::PI * 1e-3 * diameter_mm * record.conditions.spindle_hz / record.conditions.depth_m
    };
    let speed_per_depth = records.iter().map(speed).sum::<f64>() / records.len().max(1) as f64;
    let Some(hertz) = baseline.lowest_hz() else { return };
    let stiffest = baseline
        .axes
        .iter()
        .filter_map(|axis| {
            Some(
                baseline.first_order.receptance(0.0)?[(*axis, *axis)]
                    .re
                    .recip()
                    .abs(),
            )
        })
        .fold(f64::INFINITY, f64::min);
    let damping = 2.0 * DAMPING_RATIO * stiffest / (std::f64::consts::TAU * hertz);
    let width = damping * speed_per_depth;
    let along_chip = move |z: &[f64]| vec![("process_damping_n_per_m", width * z[0])];
    let with_friction = move |z: &[f64]| {
        vec![
            ("process_damping_n_per_m", width * z[0]),
            ("friction", FLANK_FRICTION * z[1]),
        ]
    };
    let (effect, place) = (EffectName::ProcessDamping, Location::Everywhere);
    let coordinates = vec![Coordinate::POSITIVE];
    all.push(Candidate::new(effect, place.clone(), coordinates, along_chip).vanishing_at_zero());
    let coordinates = vec![Coordinate::POSITIVE; 2];
    all.push(
        Candidate::new(effect, place, coordinates, with_friction)
            .vanishing_at_zero()
            .started_at(vec![vec![FAINT, 1.0]]),
    );
}

fn of_sensors(baseline: &Baseline<'_>, records: &[ReducedCut], all: &mut Vec<Candidate>) {
    let mut names: Vec<&String> = records
        .iter()
        .flat_map(|record| &record.orders.channels)
        .collect();
    names.sort();
    names.dedup();
    let sample_s = records
        .iter()
        .map(|record| 1.0 / record.rate_hz)
        .fold(0.0, f64::max);
    let modes = baseline.mode_count();
    let of_force = |name: &str| pickup_of(name).is_some_and(|pickup| pickup.quantity == Quantity::Force);
    let (forces, motions): (Vec<&String>, Vec<&String>) =
        names.iter().copied().partition(|name| of_force(name));
    for group in [forces, motions] {
        // One wrong sensitivity of an amplifier or of a calibration.
        if group.len() > 1 {
            let place = Location::Channels(group.into_iter().cloned().collect());
            let gain = |z: &[f64]| vec![("gain", (GAIN * z[0]).exp())];
            all.push(Candidate::new(
                EffectName::SensorGain,
                place,
                vec![Coordinate::FREE],
                gain,
            ));
        }
    }
    for name in names {
        let Some(pickup) = pickup_of(name) else { continue };
        let place = Location::Channel(name.clone());
        let gain = |z: &[f64]| vec![("gain", (GAIN * z[0]).exp())];
        all.push(Candidate::new(
            EffectName::SensorGain,
            place.clone(),
            vec![Coordinate::FREE],
            gain,
        ));
        let delay = move |z: &[f64]| vec![("delay_s", DELAY_SAMPLES * sample_s * z[0])];
        all.push(Candidate::new(
            EffectName::SensorDelay,
            place.clone(),
            vec![Coordinate::FREE],
            delay,
        ));
        for axis in baseline.axes.iter().filter(|axis| pickup.weights[**axis] == 0.0) {
            let place = Location::ChannelFrom(name.clone(), *axis);
            let fraction = |z: &[f64]| vec![("fraction", CROSS_AXIS * z[0])];
            all.push(Candidate::new(
                EffectName::CrossAxis,
                place,
                vec![Coordinate::FREE],
                fraction,
            ));
        }
        if modes > 1 && pickup.quantity != Quantity::Force {
            let ratio = move |z: &[f64]| {
                z.iter()
                    .zip(RATIO_KEYS)
                    .map(|(z, key)| (key, 1.0 + OFFSET * z))
                    .collect()
            };
            let coordinates = vec![Coordinate::FREE; modes.min(RATIO_KEYS.len())];
            all.push(Candidate::new(
                EffectName::SensorOffsetFromToolTip,
                place,
                coordinates,
                ratio,
            ));
        }
    }
}

/// Keys of the ratio of each mode.
const RATIO_KEYS: [&str; 6] = ["ratio_1", "ratio_2", "ratio_3", "ratio_4", "ratio_5", "ratio_6"];
