//! What a pipeline says and shows, told by a device or taken straight from it.

use crate::bench::*;
use crate::support::SETTINGS;
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::{Band, Monitor, Report, State, Strobe};
use quietcut_core::protocol::message::MAX_FEED_EDGES;
use quietcut_core::protocol::{Feed, Request, Response, SpectrumChunk};
use quietcut_core::tachometer::Edge;

/// What a pipeline says and shows.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Heard {
    pub(crate) reports: Vec<Report>,
    pub(crate) strobes: Vec<(u32, Strobe)>,
    pub(crate) spectra: Vec<(Band, u32, u32, Vec<u32>)>,
}

impl Heard {
    pub(crate) fn take(&mut self, responses: Vec<Response>) {
        for response in responses {
            match response {
                Response::Report(report) => self.reports.push(report),
                Response::Strobes(chunk) => {
                    self.strobes
                        .extend(chunk.strobes.iter().map(|strobe| (chunk.sequence, *strobe)));
                }
                Response::Spectrum(chunk) => self.take_spectrum(&chunk),
                other => panic!("{other:?}"),
            }
        }
    }

    pub(crate) fn take_spectrum(&mut self, chunk: &SpectrumChunk) {
        if chunk.first == 0 {
            self.spectra
                .push((chunk.band, chunk.sequence, chunk.bin.0.to_bits(), Vec::new()));
        }
        let (band, sequence, bin, power) = self.spectra.last_mut().unwrap();
        assert_eq!(
            (*band, *sequence, *bin, power.len()),
            (
                chunk.band,
                chunk.sequence,
                chunk.bin.0.to_bits(),
                usize::from(chunk.first)
            )
        );
        power.extend(chunk.power.iter().map(|power| power.to_bits()));
    }
}

/// What the same blocks make of a pipeline without a device around it.
pub(crate) fn straight(
    blocks: &[(quietcut_core::acceleration::Block, Vec<Edge>)],
    table: Option<&LobeTable>,
) -> Heard {
    let monitor = Monitor::new(SETTINGS).unwrap();
    let mut state = State::default();
    let mut heard = Heard::default();
    for (block, edges) in blocks {
        heard
            .reports
            .push(monitor.step(&mut state, block, edges, table, Some(&POINT)));
        heard
            .strobes
            .extend(state.strobes().iter().map(|strobe| (block.sequence, *strobe)));
        for band in [Band::Structure, Band::Tool] {
            if !state.has_fresh_spectrum(band) {
                continue;
            }
            let spectrum = state.spectrum(band).unwrap();
            let power = spectrum.power.iter().map(|power| power.to_bits()).collect();
            heard
                .spectra
                .push((band, block.sequence, spectrum.bin.0.to_bits(), power));
        }
    }
    heard
}

pub(crate) fn feed(block: &quietcut_core::acceleration::Block, edges: &[Edge]) -> Request {
    assert!(edges.len() <= MAX_FEED_EDGES);
    Request::Feed(Feed::new(block, edges.iter().copied().collect()))
}
