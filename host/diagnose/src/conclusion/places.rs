//! Places of an unexplained residual: orders, frequencies and times at which it exceeds its noise, by channel and record.

use std::f64::consts::TAU;
use std::fmt;

use quietcut_numerics::statistics::chi_squared_quantile;
use serde::Serialize;

use crate::conclusion::residual_views::ResidualView;
use crate::signal::grid::Grid;

/// Probability that noise alone has a place anywhere in all channels of all records.
pub(crate) const FALSE_PLACE: f64 = 0.01;
/// Share of the residual energy above the noise that the places hold together.
const HELD: f64 = 0.9;
/// Largest number of places of one kind.
const PLACES_MAX: usize = 16;
/// Largest number of frequency bands of equal width of a channel.
const BANDS: usize = 2048;
/// Number of time segments of equal length of a record, and of those the largest number that is an event.
const SEGMENTS: usize = 40;
const EVENT: usize = 4;

/// Kind of a [`Place`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum PlaceKind {
    /// Orders: multiples of the spindle frequency.
    Order,
    /// Frequencies, Hz.
    Frequency,
    /// Times from the start of the record as it is compared, s.
    Time,
}

/// Where in a channel the residual exceeds its noise.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Place {
    /// What `from` and `to` count.
    pub kind: PlaceKind,
    /// Name of the channel.
    pub channel: String,
    /// First order, frequency or time of the place.
    pub from: f64,
    /// Last order, frequency or time of the place; with frequencies and times the end of the range.
    pub to: f64,
    /// Numbers of the records, from 1 in the order in which they were given.
    pub records: Vec<usize>,
}

impl fmt::Display for Place {
    /// `orders 3 to 5 of ax`, with the records.
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.kind {
            PlaceKind::Order if self.from == self.to => write!(out, "order {}", self.from)?,
            PlaceKind::Order => write!(out, "orders {} to {}", self.from, self.to)?,
            PlaceKind::Frequency => write!(out, "{:.2} to {:.2} Hz", self.from, self.to)?,
            PlaceKind::Time => write!(out, "{:.3} to {:.3} s", self.from, self.to)?,
        }
        let records: Vec<String> = self.records.iter().map(usize::to_string).collect();
        let of = if records.len() == 1 { "record" } else { "records" };
        write!(out, " of {} in {of} {}", self.channel, records.join(", "))
    }
}

/// A range of a channel of a record that exceeds its noise.
#[derive(Clone, Debug)]
pub(crate) struct Excess {
    /// Number of the record, from 1.
    pub record: usize,
    /// Name of the channel.
    pub channel: String,
    /// Ends of the range.
    pub from: f64,
    pub to: f64,
    /// Energy above that of the noise, in units of its variance.
    pub energy: f64,
}

/// The places of most of the energy of `cells`, largest first. Cells of one channel and record at most `gap` apart are one range, and equal
/// ranges of a channel in several records one place.
pub(crate) fn merged(kind: PlaceKind, mut cells: Vec<Excess>, gap: f64) -> Vec<Place> {
    cells.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    let whole: f64 = cells.iter().map(|cell| cell.energy).sum();
    let mut held = 0.0;
    cells.retain(|cell| {
        let is_within = held < HELD * whole;
        held += cell.energy;
        is_within
    });
    cells.sort_by(|a, b| {
        let by_signal = (a.record, &a.channel).cmp(&(b.record, &b.channel));
        by_signal.then(a.from.total_cmp(&b.from))
    });
    let mut ranges: Vec<Excess> = Vec::new();
    for cell in cells {
        match ranges.last_mut() {
            Some(last)
                if (last.record, &last.channel) == (cell.record, &cell.channel)
                    && cell.from - last.to <= gap =>
            {
                last.to = cell.to;
                last.energy += cell.energy;
            }
            _ => ranges.push(cell),
        }
    }
    ranges.sort_by(|a, b| b.energy.total_cmp(&a.energy));
    let mut places: Vec<Place> = Vec::new();
    for range in ranges {
        let known = places
            .iter_mut()
            .find(|place| place.channel == range.channel && (place.from, place.to) == (range.from, range.to));
        match known {
            Some(place) => place.records.push(range.record),
            None => places.push(Place {
                kind,
                channel: range.channel,
                from: range.from,
                to: range.to,
                records: vec![range.record],
            }),
        }
    }
    places.truncate(PLACES_MAX);
    places.iter_mut().for_each(|place| place.records.sort_unstable());
    places
}

/// Events first, then the frequencies of the residuals that the views show.
pub(crate) fn of_views(views: &[ResidualView]) -> Vec<Place> {
    let mut places = events(views);
    places.extend(frequencies(views));
    places
}

/// Times at which most of the residual energy is that of a few segments.
pub(crate) fn events(views: &[ResidualView]) -> Vec<Place> {
    let cells = views.iter().flat_map(|view| {
        let residual = view.unexplained();
        let segment = residual.len().div_ceil(SEGMENTS).max(1);
        let noise = view.deviation.powi(2).max(f64::MIN_POSITIVE);
        let mut energies: Vec<(usize, f64)> = residual
            .chunks(segment)
            .map(|chunk| chunk.iter().map(|x| x * x).sum::<f64>() / noise - chunk.len() as f64)
            .enumerate()
            .collect();
        let whole: f64 = energies.iter().map(|(_, energy)| energy.max(0.0)).sum();
        energies.sort_by(|a, b| b.1.total_cmp(&a.1));
        energies.truncate(EVENT);
        let held: f64 = energies.iter().map(|(_, energy)| energy.max(0.0)).sum();
        let quantile = chi_squared_quantile(
            1.0 - FALSE_PLACE / (SEGMENTS * views.len()) as f64,
            segment as f64,
        );
        energies.retain(|(_, energy)| held >= HELD * whole && *energy > quantile - segment as f64);
        energies.into_iter().map(move |(index, energy)| Excess {
            record: view.number,
            channel: view.channel.clone(),
            from: (index * segment) as f64 / view.rate_hz,
            to: ((index + 1) * segment).min(residual.len()) as f64 / view.rate_hz,
            energy,
        })
    });
    merged(PlaceKind::Time, cells.collect(), 1e-9)
}

/// Frequencies at which residuals exceed white noise of the deviation of their channels.
fn frequencies(views: &[ResidualView]) -> Vec<Place> {
    let mut widest = 0.0_f64;
    let mut cells = Vec::new();
    for view in views {
        let residual = view.unexplained();
        if residual.is_empty() {
            continue;
        }
        let grid = Grid::new(residual.len(), view.rate_hz, 0.0, 1);
        let noise = residual.len() as f64 * view.deviation.powi(2).max(f64::MIN_POSITIVE);
        let power: Vec<f64> = grid
            .spectrum(residual)
            .iter()
            .map(|bin| bin.norm_sqr() / noise)
            .collect();
        let compared = (0..power.len())
            .take_while(|bin| grid.omega(*bin) <= TAU * view.highest_hz)
            .count();
        let band = compared.div_ceil(BANDS).max(1);
        let step_hz = grid.omega(1) / TAU;
        widest = widest.max(band as f64 * step_hz);
        // The transform is padded: a band holds fewer independent values than bins.
        let share = residual.len() as f64 / (2 * power.len()).max(1) as f64;
        let bands = compared.div_ceil(band) * views.len();
        for (index, bins) in power[..compared].chunks(band).enumerate() {
            let values = (2.0 * share * bins.len() as f64).max(2.0);
            let level = bins.iter().sum::<f64>() / bins.len() as f64;
            if values * level > chi_squared_quantile(1.0 - FALSE_PLACE / bands as f64, values) {
                cells.push(Excess {
                    record: view.number,
                    channel: view.channel.clone(),
                    from: (index * band) as f64 * step_hz,
                    to: (index * band + bins.len()) as f64 * step_hz,
                    energy: values * (level - 1.0),
                });
            }
        }
    }
    // Neighbouring bands belong together, and those beside a gap of a single one.
    merged(PlaceKind::Frequency, cells, 1.5 * widest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(number: usize, residual: Vec<f64>) -> ResidualView {
        ResidualView {
            number,
            record: format!("{number}.csv"),
            channel: "ax".into(),
            unit: "m/s²",
            rate_hz: 1000.0,
            highest_hz: 400.0,
            deviation: 1.0,
            measured: residual.clone(),
            residual,
            left: Vec::new(),
            missing: None,
            spindle_motion: None,
        }
    }

    /// Noise of unit variance by a linear congruential generator.
    fn noise(seed: u64, count: usize) -> Vec<f64> {
        let mut state = seed;
        let mut next = || {
            state = state
                .wrapping_mul(6364136223846793005)
                .wrapping_add(1442695040888963407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        (0..count).map(|_| (0..12).map(|_| next()).sum::<f64>()).collect()
    }

    #[test]
    fn noise_has_no_place() {
        let views: Vec<ResidualView> = (1..4).map(|seed| view(seed, noise(seed as u64, 8000))).collect();
        assert_eq!(of_views(&views), Vec::new());
    }

    #[test]
    fn a_tone_is_placed_at_its_frequency_in_the_records_that_have_it() {
        let mut views: Vec<ResidualView> = (1..4).map(|seed| view(seed, noise(seed as u64, 8000))).collect();
        for view in &mut views[1..] {
            for (index, sample) in view.residual.iter_mut().enumerate() {
                *sample += 0.5 * (TAU * 123.4 * index as f64 / 1000.0).sin();
            }
        }
        let places = of_views(&views);
        assert!(!places.is_empty());
        assert!(places.iter().all(|place| place.kind == PlaceKind::Frequency));
        assert!(places[0].from <= 123.4 && places[0].to >= 123.4, "{places:?}");
        assert!(places[0].to - places[0].from < 2.0, "{places:?}");
        let mut records: Vec<usize> = places.iter().flat_map(|place| place.records.clone()).collect();
        records.sort_unstable();
        records.dedup();
        assert_eq!(records, [2, 3]);
    }

    #[test]
    fn an_event_is_placed_at_its_time() {
        let mut view = view(1, noise(5, 8000));
        view.residual[4321..4330].fill(60.0);
        let places = of_views(&[view]);
        assert_eq!(places[0].kind, PlaceKind::Time);
        assert!(places[0].from <= 4.321 && places[0].to >= 4.33, "{places:?}");
        assert!(places[0].to - places[0].from < 0.41, "{places:?}");
    }

    #[test]
    fn neighbouring_orders_are_one_place_of_all_records_that_have_them() {
        let cell = |record: usize, order: f64, energy: f64| Excess {
            record,
            channel: "fy".into(),
            from: order,
            to: order,
            energy,
        };
        let cells = vec![
            cell(1, 3.0, 50.0),
            cell(1, 4.0, 40.0),
            cell(2, 3.0, 60.0),
            cell(2, 4.0, 30.0),
            cell(1, 9.0, 25.0),
            cell(2, 40.0, 1.0),
        ];
        let places = merged(PlaceKind::Order, cells, 1.0);
        assert_eq!(places.len(), 2, "{places:?}");
        assert_eq!((places[0].from, places[0].to), (3.0, 4.0));
        assert_eq!(places[0].records, [1, 2]);
        assert_eq!(places[0].to_string(), "orders 3 to 4 of fy in records 1, 2");
        assert_eq!((places[1].from, &places[1].records[..]), (9.0, &[1][..]));
    }
}
