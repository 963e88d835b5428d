//! Outputs of the signal chain for a cut, on the host and on a device, for a comparison bit by bit.

use std::collections::BTreeMap;
use std::time::Duration;

use quietcut::device::{Client, Event};
use quietcut::simulate::SensedCut;
use quietcut_core::acceleration::Block;
use quietcut_core::detector::Verdict;
use quietcut_core::lobes::LobeTable;
use quietcut_core::monitor::{Band, Monitor, Report, Settings, State};
use quietcut_core::protocol::{Reports, Subscription};
use quietcut_core::tachometer::Edge;
use quietcut_core::units::Nanoseconds;
use quietcut_core::working_point::WorkingPoint;
use quietcut_firmware::stimulus::Stimulus;

/// Subscription to all events of a device.
pub const ALL: Subscription = Subscription {
    reports: Reports::All,
    spectra: true,
    strobes: true,
};

/// Block of samples and tachometer edges of one step of the signal chain.
pub type Step = (Block, Vec<Edge>);

/// Splits a sensor signal into steps; a tachometer edge belongs to the last block that starts before it.
pub fn steps(sensed: SensedCut) -> Vec<Step> {
    let mut edges = sensed.edges.into_iter().peekable();
    let ends: Vec<_> = sensed.blocks.iter().skip(1).map(|block| block.time).collect();
    let ends = ends.into_iter().chain([Nanoseconds(u64::MAX)]);
    let steps = sensed.blocks.into_iter().zip(ends).map(|(block, end)| {
        let mine = std::iter::from_fn(|| edges.next_if(|edge| edge.time < end));
        let mine = mine.collect();
        (block, mine)
    });
    steps.collect()
}

/// Converts steps to the stimuli of the emulated board.
pub fn stimuli(steps: &[Step]) -> Vec<Stimulus> {
    let of = |(block, edges): &Step| {
        let edges = edges.iter().copied().map(Stimulus::Edge);
        edges.chain([Stimulus::Block(block.clone())]).collect::<Vec<_>>()
    };
    steps.iter().flat_map(of).collect()
}

/// Recorded outputs of the signal chain. Numbers are compared by their bits: a NaN equals itself, and 0 differs from −0.
#[derive(Debug, Default, PartialEq, Eq)]
pub struct ChainOutputs {
    /// Serialized reports (postcard), in order.
    pub reports: Vec<Vec<u8>>,
    /// Stroboscopic samples, keyed by the number of their block.
    pub strobes: BTreeMap<u32, Vec<u8>>,
    /// Bins of the spectra, keyed by band and number of the completing block.
    pub spectra: BTreeMap<(bool, u32), Vec<u32>>,
}

fn bytes<T: serde::Serialize>(value: &T) -> Vec<u8> {
    let mut buffer = [0; 512];
    postcard::to_slice(value, &mut buffer)
        .expect("room for a message")
        .to_vec()
}

impl ChainOutputs {
    /// Runs the signal chain on the host over a cut.
    pub fn on_host(
        settings: Settings,
        table: Option<&[u8]>,
        cut: Option<&WorkingPoint>,
        steps: &[Step],
    ) -> Self {
        let monitor = Monitor::new(settings).expect("settings that can be");
        let table = table.map(|bytes| LobeTable::parse(bytes).expect("a table"));
        let mut state = State::default();
        let mut said = Self::default();
        for (block, edges) in steps {
            let report = monitor.step(&mut state, block, edges, table.as_ref(), cut);
            said.reports.push(bytes(&report));
            for strobe in state.strobes() {
                said.strobes
                    .entry(block.sequence)
                    .or_default()
                    .extend(bytes(strobe));
            }
            for band in [Band::Structure, Band::Tool] {
                if state.has_fresh_spectrum(band)
                    && let Some(spectrum) = state.spectrum(band)
                {
                    let bins = spectrum.power.iter().map(|power| power.to_bits()).collect();
                    said.spectra.insert((band == Band::Tool, block.sequence), bins);
                }
            }
        }
        said
    }

    /// Collects the events of a device until it has reported `blocks` blocks and sends nothing more.
    pub fn from_device(client: &mut Client, blocks: usize, patience: Duration) -> Self {
        let mut said = Self::default();
        let quiet = Duration::from_millis(200);
        loop {
            let wait = if said.reports.len() < blocks {
                patience
            } else {
                quiet
            };
            let event = client.next_event(wait).expect("the line holds");
            match event {
                Some(Event::Report(report)) => said.reports.push(bytes(&report)),
                Some(Event::Strobes(chunk)) => {
                    let strobes = said.strobes.entry(chunk.sequence).or_default();
                    for strobe in &chunk.strobes {
                        strobes.extend(bytes(strobe));
                    }
                }
                Some(Event::Spectrum(chunk)) => {
                    let key = (chunk.band == Band::Tool, chunk.sequence);
                    let bins = said.spectra.entry(key).or_default();
                    assert_eq!(
                        bins.len(),
                        usize::from(chunk.first),
                        "pieces of a spectrum in their order"
                    );
                    bins.extend(chunk.power.iter().map(|power| power.to_bits()));
                }
                None => {
                    let reports = said.reports.len();
                    assert!(
                        reports >= blocks,
                        "only {reports} reports of {blocks} blocks within {patience:?}"
                    );
                    return said;
                }
            }
        }
    }

    /// Asserts that the device gave the same outputs; a failure shows the first report that differs.
    pub fn assert_same(&self, device: &Self) {
        self.assert_same_reports(device);
        assert!(
            self.strobes == device.strobes,
            "points of the stroboscopic map differ"
        );
        let which = |said: &Self| said.spectra.keys().copied().collect::<Vec<_>>();
        assert_eq!(which(self), which(device), "blocks with spectra");
        assert!(self.spectra == device.spectra, "bins of the spectra differ");
    }

    /// Asserts that the device gave the same reports.
    pub fn assert_same_reports(&self, device: &Self) {
        let pairs = self.reports.iter().zip(&device.reports);
        for (number, (here, there)) in pairs.enumerate() {
            let words = |bytes| postcard::from_bytes::<Report>(bytes).expect("a report");
            assert!(
                here == there,
                "report {number}: host {:?}, device {:?}",
                words(here),
                words(there)
            );
        }
        assert_eq!(self.reports.len(), device.reports.len(), "number of reports");
    }

    /// Kind of the first reported chatter.
    pub fn first_alarm(&self) -> Option<Verdict> {
        let verdicts = self.reports.iter().map(|bytes| {
            let report: Report = postcard::from_bytes(bytes).expect("a report");
            report.judgement.verdict
        });
        verdicts.into_iter().find(|verdict| verdict.is_chatter())
    }
}
