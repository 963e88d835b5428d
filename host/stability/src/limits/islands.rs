//! Regions of stability or of chatter that begin and end between the speeds of a chart.

use super::speed_line::SpeedLine;

/// Width in speed, rev/min, of the narrowest region of stability or of chatter that contains neither the first nor the
/// last speed of a chart; `None` if there is none. `lines` are in ascending order of speed.
pub(super) fn narrowest_island_rpm(lines: &[SpeedLine], depth_mm: f64) -> Option<f64> {
    let rpm: Vec<f64> = lines.iter().map(|line| line.rpm).collect();
    let stable: Vec<_> = lines.iter().map(|line| line.stable_mm.clone()).collect();
    let unstable: Vec<_> = stable
        .iter()
        .map(|intervals| complement(intervals, depth_mm))
        .collect();
    let mut widths = island_widths_rpm(&rpm, &stable);
    widths.extend(island_widths_rpm(&rpm, &unstable));
    widths.into_iter().min_by(f64::total_cmp)
}

/// Depth intervals between 0 and `depth_mm` that lie outside the given ascending intervals.
fn complement(intervals: &[[f64; 2]], depth_mm: f64) -> Vec<[f64; 2]> {
    let starts = std::iter::once(0.0).chain(intervals.iter().map(|interval| interval[1]));
    let ends = intervals
        .iter()
        .map(|interval| interval[0])
        .chain(std::iter::once(depth_mm));
    starts
        .zip(ends)
        .filter(|(from, to)| to > from)
        .map(|(from, to)| [from, to])
        .collect()
}

/// Widths in speed, rev/min, of all connected regions that contain neither the first nor the last speed of a chart.
/// `intervals` has the depth intervals at each speed, in the order of `rpm`. Intervals at neighbouring speeds belong to
/// one region if they overlap in depth. A region extends half way to the next lower and the next higher speed.
fn island_widths_rpm(rpm: &[f64], intervals: &[Vec<[f64; 2]>]) -> Vec<f64> {
    let nodes: Vec<(usize, [f64; 2])> = intervals
        .iter()
        .enumerate()
        .flat_map(|(speed, of)| of.iter().map(move |interval| (speed, *interval)))
        .collect();
    // The region to which each of `nodes` belongs, by the index of one node of this region.
    let mut region: Vec<usize> = (0..nodes.len()).collect();
    for (a, (speed, one)) in nodes.iter().enumerate() {
        for (b, (next, other)) in nodes.iter().enumerate().skip(a + 1) {
            if *next > speed + 1 {
                break;
            }
            if *next == speed + 1 && one[0] < other[1] && other[0] < one[1] {
                let (from, to) = (region[b], region[a]);
                region
                    .iter_mut()
                    .filter(|of| **of == from)
                    .for_each(|of| *of = to);
            }
        }
    }
    let last = intervals.len().saturating_sub(1);
    (0..nodes.len())
        .filter_map(|number| {
            let speeds = || {
                (0..nodes.len())
                    .filter(|&node| region[node] == number)
                    .map(|node| nodes[node].0)
            };
            let (from, to) = (speeds().min()?, speeds().max()?);
            let is_inside = from > 0 && to < last;
            is_inside.then(|| 0.5 * (rpm[to] + rpm[to + 1]) - 0.5 * (rpm[from - 1] + rpm[from]))
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_that_begin_at_one_speed_stay_apart_until_they_touch() {
        let rpm = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0];
        let (low, high) = ([0.0, 1.0], [2.0, 3.0]);
        let widths = |intervals: [&[[f64; 2]]; 6]| {
            let mut widths = island_widths_rpm(&rpm, &intervals.map(<[_]>::to_vec));
            widths.sort_by(f64::total_cmp);
            widths
        };
        // Two islands begin at one speed; one ends earlier.
        assert_eq!(
            widths([&[], &[low, high], &[low, high], &[high], &[], &[]]),
            [2.0, 3.0]
        );
        // A bridge makes one region of them.
        assert_eq!(
            widths([&[], &[low, high], &[[0.5, 2.5]], &[high], &[], &[]]),
            [3.0]
        );
        // A region at the first or the last speed is no island.
        assert_eq!(widths([&[low], &[low], &[], &[high], &[high], &[high]]), [0.0; 0]);
        assert_eq!(widths([&[low], &[], &[high], &[], &[low], &[low]]), [1.0]);
    }
}
