//! Decides the advice on spindle speed or depth: from the lobe table first, from the tooth-passing rule otherwise.

use super::proposal::{Action, Advice, Obstacle, Source};
use super::quiet_speed_search::QuietSpeedSearch;
use super::rule::tooth_passing_speed;
use crate::detector::{Judgement, Verdict};
use crate::lobes::{IntervalKind, LobeTable, NotKnown, TabulatedStability};
use crate::units::Rpm;
use crate::working_point::{Limits, Tool, WorkingPoint};

/// Returns the advice for the present verdict and spindle speed.
///
/// `limits` are intersected with the limits of the table, if it has any. Without chatter the result is
/// [`Action::Keep`]. A point that is unstable in the table is never advised, nor a speed
/// at which it has no stable depth.
///
/// Cost: the search for a quiet speed passes over the entries of the table for this cut at most once, apart from the
/// speed band around the present speed, which it passes twice. It begins at this band. If it finds no quiet speed,
/// the search for a smaller depth passes over the entries again. Both also interpolate columns of the table. Call it
/// when an input changes, not for every block.
pub fn advise(
    judgement: &Judgement,
    speed: Rpm,
    table: Option<&LobeTable<'_>>,
    working_point: Option<&WorkingPoint>,
    limits: Option<&Limits>,
    tool: &Tool,
) -> Advice {
    let set_depth = working_point.map(|point| point.axial_depth);
    let keep = Advice {
        action: Action::Keep,
        speed,
        depth: set_depth,
        source: if table.is_some() {
            Source::Table
        } else {
            Source::ToothPassingRule
        },
        assumed: None,
        obstacle: None,
    };
    if !judgement.verdict.is_chatter() {
        return keep;
    }
    // The negated comparison also refuses a spindle speed that is NaN.
    if !(speed.0 > 0.0 && speed.0.is_finite()) {
        return Advice {
            action: Action::NotKnown,
            obstacle: Some(Obstacle::Speed),
            ..keep
        };
    }
    let range = speed_range(limits, table);
    let cut = match cut_in_table(judgement, speed, table, working_point, tool) {
        Ok(cut) => cut,
        Err(obstacle) => {
            return by_rule(
                judgement,
                tool,
                (range, table),
                None,
                Advice {
                    obstacle: Some(obstacle),
                    ..keep
                },
            );
        }
    };
    let keep = Advice {
        assumed: working_point.is_none().then_some(cut.at),
        ..keep
    };
    match by_table(&cut, speed, range, keep) {
        Ok(advice) => advice,
        Err(obstacle) => by_rule(
            judgement,
            tool,
            (range, table),
            Some(&cut),
            Advice {
                obstacle: Some(obstacle),
                ..keep
            },
        ),
    }
}

/// A lobe table with the working point of the cut for which advice is given. The table covers this working point.
struct Cut<'t> {
    table: &'t LobeTable<'t>,
    at: WorkingPoint,
}

/// Pairs the lobe table with the working point as set or assumed. An error if there is no table, if it is not usable
/// for this tool and working point, or if it has no chatter from which to assume a depth.
fn cut_in_table<'t>(
    judgement: &Judgement,
    speed: Rpm,
    table: Option<&'t LobeTable<'t>>,
    working_point: Option<&WorkingPoint>,
    tool: &Tool,
) -> Result<Cut<'t>, Obstacle> {
    let table = table.ok_or(Obstacle::NoTable)?;
    if table.teeth() != tool.teeth {
        let mismatch = NotKnown::Teeth {
            asked: tool.teeth,
            table: table.teeth(),
        };
        return Err(Obstacle::Table(mismatch));
    }
    let at = match working_point {
        Some(point) => *point,
        None => assumed_point(judgement, speed, table)?,
    };
    // The lookup uses the slowest speed of the table, because the present speed may lie outside it. Whether the table
    // has a layer for the working point does not depend on the speed.
    let first = table.speed(0).ok_or(Obstacle::Table(NotKnown::Damaged))?;
    match table.lookup(first, &at) {
        TabulatedStability::NotKnown(why) if why != NotKnown::Undecided => Err(Obstacle::Table(why)),
        _ => Ok(Cut { table, at }),
    }
}

/// The working point that advice assumes if none is set: that of the first layer of the lobe table, at the smallest
/// depth with chatter of the detected kind at the present speed, else with chatter of any kind.
fn assumed_point(judgement: &Judgement, speed: Rpm, table: &LobeTable<'_>) -> Result<WorkingPoint, Obstacle> {
    let layer = table.layers().next().ok_or(Obstacle::Table(NotKnown::Damaged))?;
    let mut at = WorkingPoint {
        axial_depth: table.depths().0,
        start: layer.start,
        exit: layer.exit,
        feed_per_tooth: layer.feed_from,
        posture: layer.posture,
    };
    let column = table.column(speed, &at).map_err(Obstacle::Table)?;
    let detected = match judgement.verdict {
        Verdict::PeriodDoubling => IntervalKind::Flip,
        _ => IntervalKind::Hopf,
    };
    let mut unstable = column
        .intervals()
        .iter()
        .filter(|i| i.kind != IntervalKind::Undecided);
    let same_kind = unstable.clone().find(|i| i.kind == detected);
    at.axial_depth = same_kind.or(unstable.next()).ok_or(Obstacle::Contradicted)?.from;
    Ok(at)
}

/// The speed range in rev/min that both the machine's limits and the limits in the table allow.
fn speed_range(limits: Option<&Limits>, table: Option<&LobeTable<'_>>) -> (f32, f32) {
    let of_table = table.and_then(LobeTable::limits);
    limits
        .into_iter()
        .chain(&of_table)
        .fold((0.0, f32::INFINITY), |(from, to), limits| {
            (f32::max(from, limits.rpm_min.0), f32::min(to, limits.rpm_max.0))
        })
}

/// Advice from the lobe table: a quiet speed (stable with margin) at the present depth, else a smaller depth.
fn by_table(cut: &Cut<'_>, speed: Rpm, range: (f32, f32), keep: Advice) -> Result<Advice, Obstacle> {
    let quiet = QuietSpeedSearch::new(cut.table, &cut.at, range).map_err(Obstacle::Table)?;
    if let Some(quiet_speed) = quiet.nearest_speed(speed) {
        if quiet_speed == speed {
            return Err(Obstacle::Contradicted);
        }
        return Ok(Advice {
            action: Action::Speed,
            speed: quiet_speed,
            ..keep
        });
    }
    let (speed, depth) = quiet.largest_depth(speed).ok_or(Obstacle::NothingStable)?;
    Ok(Advice {
        action: Action::Depth,
        speed,
        depth: Some(depth),
        ..keep
    })
}

/// True if the table has no stable depth at a speed, in no layer: so a table states the speeds at which the spindle must
/// not run, whatever the tool and the cut.
fn is_excluded(table: &LobeTable<'_>, speed: Rpm) -> bool {
    let mut layers = table.layers();
    layers.len() > 0
        && layers.all(|layer| {
            let at = WorkingPoint {
                axial_depth: table.depths().0,
                start: layer.start,
                exit: layer.exit,
                feed_per_tooth: layer.feed_from,
                posture: layer.posture,
            };
            let column = table.column(speed, &at);
            column.is_ok_and(|column| column.stable().next().is_none())
        })
}

/// Advice from the tooth-passing rule. Speeds outside the speed range, speeds at which the lobe table has no stable depth at all,
/// and speeds that it calls unstable or undecided for the cut, are skipped.
fn by_rule(
    judgement: &Judgement,
    tool: &Tool,
    ((from_rpm, to_rpm), table): ((f32, f32), Option<&LobeTable<'_>>),
    cut: Option<&Cut<'_>>,
    keep: Advice,
) -> Advice {
    let keep = Advice {
        source: Source::ToothPassingRule,
        ..keep
    };
    let Some(chatter) = judgement
        .chatter
        .filter(|hertz| hertz.0 > 0.0 && hertz.0.is_finite())
    else {
        return Advice {
            action: Action::NotKnown,
            obstacle: Some(Obstacle::ChatterFrequency),
            ..keep
        };
    };
    let is_admissible = |candidate: Rpm| {
        let is_refused = |cut: &Cut<'_>| {
            matches!(
                cut.table.lookup(candidate, &cut.at),
                TabulatedStability::Unstable { .. } | TabulatedStability::NotKnown(NotKnown::Undecided)
            )
        };
        (from_rpm..=to_rpm).contains(&candidate.0)
            && !cut.is_some_and(is_refused)
            && !table.is_some_and(|table| is_excluded(table, candidate))
    };
    match tooth_passing_speed(keep.speed, chatter, tool, is_admissible) {
        Some(speed) => Advice {
            action: Action::Speed,
            speed,
            ..keep
        },
        None => Advice {
            action: Action::Depth,
            depth: None,
            obstacle: Some(Obstacle::NoSpeedWithinLimits),
            ..keep
        },
    }
}
