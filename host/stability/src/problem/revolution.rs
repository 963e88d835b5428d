//! Collocation of the delay equation over one revolution of a tool with variable pitch. The delayed displacement lies
//! between nodes and is interpolated.
//!
//! The state of the delay equation is x at the start of the revolution, and the displacements p along the chip normals
//! in those subintervals of the preceding revolution whose surface the present revolution cuts.

use nalgebra::DMatrix;

use super::element::{CuttingTooth, Element, Step};
use super::exponential::Exponential;
use super::pitched::Pitched;
use super::revolution_mesh::{Fineness, Flight, RevolutionMesh, Subinterval};

/// Delay equation of one revolution at one spindle speed, collocated on its mesh.
pub(crate) struct Revolution<'a> {
    pub(crate) pitched: &'a Pitched,
    pub(crate) mesh: RevolutionMesh,
    /// Element of each subinterval.
    pub(crate) elements: Vec<Element>,
}

impl<'a> Revolution<'a> {
    /// Divides the revolution at a spindle speed, for depths up to `depth_m`; `None` if no preceding tooth has cut the
    /// surface in front of some tooth.
    pub(crate) fn new(pitched: &'a Pitched, rpm: f64, depth_m: f64, fineness: Fineness) -> Option<Self> {
        let mesh = RevolutionMesh::new(pitched, rpm, depth_m, fineness, Flight::Whole)?;
        let exponential = Exponential::new(&pitched.problem.structure.a);
        let mut elements: Vec<Element> = Vec::with_capacity(mesh.subintervals.len());
        // Kinks of the displacement lie at entries and exits of teeth, and delays later. All subintervals between two
        // neighbouring kinks have equal lengths: the response of the free structure over one of them serves for all.
        let mut step: Option<(usize, f64, Step<'_>)> = None;
        for subinterval in &mesh.subintervals {
            if subinterval.cutting.is_empty() {
                elements.push(free_flight(&exponential, subinterval.duration_s));
                continue;
            }
            let (nodes, duration_s) = (subinterval.gauss.nodes.len(), subinterval.duration_s);
            let step = match &mut step {
                Some((of_nodes, of_s, step)) if (*of_nodes, *of_s) == (nodes, duration_s) => &*step,
                other => {
                    let made = Step::new(&pitched.problem, &exponential, subinterval.gauss, duration_s);
                    &other.insert((nodes, duration_s, made)).2
                }
            };
            elements.push(element(pitched, mesh.passages.rad_per_s, step, subinterval));
        }
        Some(Self {
            pitched,
            mesh,
            elements,
        })
    }
}

fn free_flight(exponential: &Exponential, duration_s: f64) -> Element {
    let flow = exponential.at(duration_s);
    let order = flow.nrows();
    Element {
        flow,
        observe: DMatrix::zeros(0, order),
        kernel: DMatrix::zeros(0, 0),
        drive: DMatrix::zeros(order, 0),
        ports: Vec::new(),
        axial: None,
    }
}

fn element(pitched: &Pitched, rad_per_s: f64, step: &Step<'_>, subinterval: &Subinterval) -> Element {
    let start = pitched.problem.process.engagement.start;
    let teeth: Vec<CuttingTooth> = subinterval
        .cutting
        .iter()
        .map(|passage| CuttingTooth {
            immersion: start - passage.entry_s * rad_per_s,
            feed_m: passage.feed_m,
        })
        .collect();
    let (phase, turn) = (
        subinterval.start_s * rad_per_s,
        subinterval.duration_s * rad_per_s,
    );
    step.element_of(&pitched.problem, &teeth, phase, turn)
}
