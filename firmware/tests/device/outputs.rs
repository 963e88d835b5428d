//! Outputs of the signal chain: from the messages of a device, and from the chain without a device.

use crate::bench::*;
use crate::support::SETTINGS;
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::{Band, Monitor, Report, State, Strobe};
use quietcut_core::protocol::message::MAX_FEED_EDGES;
use quietcut_core::protocol::{Feed, Request, Response, SpectrumChunk};
use quietcut_core::tachometer::Edge;

/// Reports, stroboscopic points and spectra of the signal chain.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Outputs {
    pub(crate) reports: Vec<Report>,
    pub(crate) strobes: Vec<(u32, Strobe)>,
    pub(crate) spectra: Vec<(Band, u32, u32, Vec<u32>)>,
}

impl Outputs {
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

/// The outputs of the signal chain for these blocks, without a device.
pub(crate) fn outputs_without_device(
    blocks: &[(quietcut_core::acceleration::Block, Vec<Edge>)],
    table: Option<&LobeTable>,
) -> Outputs {
    let monitor = Monitor::new(SETTINGS).unwrap();
    let mut state = State::default();
    let mut outputs = Outputs::default();
    for (block, edges) in blocks {
        outputs
            .reports
            .push(monitor.step(&mut state, block, edges, table, Some(&POINT)));
        outputs
            .strobes
            .extend(state.strobes().iter().map(|strobe| (block.sequence, *strobe)));
        for band in [Band::Structure, Band::Tool] {
            if !state.has_fresh_spectrum(band) {
                continue;
            }
            let spectrum = state.spectrum(band).unwrap();
            let power = spectrum.power.iter().map(|power| power.to_bits()).collect();
            outputs
                .spectra
                .push((band, block.sequence, spectrum.bin.0.to_bits(), power));
        }
    }
    outputs
}

pub(crate) fn feed(block: &quietcut_core::acceleration::Block, edges: &[Edge]) -> Request {
    assert!(edges.len() <= MAX_FEED_EDGES);
    Request::Feed(Feed::new(block, edges.iter().copied().collect()))
}
