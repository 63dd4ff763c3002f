//! What of a frame becomes a trace of what was chosen: which draws, over what, and what has to be
//! said of the others.

use std::collections::{BTreeMap, BTreeSet};

use ash::vk;
use screendoor_vulkan_layer::log::{Attachment, Clear, Draw, Event, Pass};

use crate::blend::{self, Rule};
use crate::depth::is_reversed;
use crate::frame::{At, Step};
use crate::samples::{Area, covers};
use crate::target::{Chosen, Place};

/// What is there before the first draw.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Base {
    /// A colour that was asked for.
    Cleared([f32; 4]),
    /// What the image held before the submission at this place.
    Loaded { submission: usize },
    /// Nothing that the program relies on.
    Undefined,
}

/// What happens, in order.
pub(crate) enum Act<'a> {
    /// A pass with a depth image begins.
    Begin(&'a Pass, &'a Attachment),
    /// A part of a depth image is cleared.
    ClearDepth(&'a Attachment, Area, f32),
    Draw(Planned<'a>),
    /// A part of the target is cleared to a colour.
    Paint(Area, [f32; 4]),
}

/// A draw that is looked at.
pub(crate) struct Planned<'a> {
    pub at: At,
    pub pass: &'a Pass,
    pub draw: &'a Draw,
    /// Records that it left.
    pub records: u64,
    /// What becomes of its fragments; `None` where they matter for their depths alone.
    pub rule: Option<Rule>,
    /// Whether it writes depths that others are tested against.
    for_depth: bool,
}

impl Planned<'_> {
    /// The depth image that its fragments are tested against.
    pub(crate) fn tested(&self) -> Option<&Attachment> {
        self.pass.depth.as_ref().filter(|_| self.draw.state.depth_test)
    }
}

/// Draws and fragments that are counted.
#[derive(Clone, Copy, Default, Debug)]
pub(crate) struct Tally {
    pub draws: u64,
    pub fragments: u64,
}

impl Tally {
    fn add(&mut self, fragments: u64) {
        self.draws += 1;
        self.fragments += fragments;
    }
}

/// What is made of a frame.
pub(crate) struct Plan<'a> {
    pub base: Base,
    pub acts: Vec<Act<'a>>,
    /// Before the last clear of all.
    pub painted_over: Tally,
    pub depth_alone: Tally,
    /// By why.
    pub refused: BTreeMap<String, [u64; 2]>,
    /// Clears of a part of the target.
    pub partial_clears: u64,
    /// What else writes to the target, and how often: before the first draw, and after.
    pub writes: BTreeMap<(bool, String), u64>,
    /// The submission of the last write before the first draw.
    pub written: Option<usize>,
    /// Depth images that draws write to of which there are no records.
    pub unrecorded: BTreeSet<Place>,
    /// Colour attachments beside the target at most.
    pub others: u32,
    /// The attachment as the first draw uses it.
    pub attachment: Option<&'a Attachment>,
}

impl<'a> Plan<'a> {
    /// Looks through the chosen frame. With `depths`, draws are kept for their depths too: those
    /// of other targets, and those that leave nothing else.
    pub(crate) fn new(chosen: &'a Chosen<'a>, depths: bool) -> Self {
        let mut plan = Plan {
            base: Base::Undefined,
            acts: Vec::new(),
            painted_over: Tally::default(),
            depth_alone: Tally::default(),
            refused: BTreeMap::new(),
            partial_clears: 0,
            writes: BTreeMap::new(),
            written: None,
            unrecorded: BTreeSet::new(),
            others: 0,
            attachment: None,
        };
        let shared = shared(chosen);
        let mut begun = false;
        // Where the acts after the last clear begin.
        let mut since = 0;
        for step in chosen.frame.steps(chosen.capture) {
            let on = step.pass.and_then(|p| p.colour.as_ref());
            let on = on.filter(|c| Place::from(*c) == chosen.place);
            match step.what {
                Event::Pass(pass) => {
                    if let Some(depth) = &pass.depth
                        && shared.contains(&depth.into())
                    {
                        plan.acts.push(Act::Begin(pass, depth));
                    }
                    if let Some(colour) = on {
                        plan.begin(chosen, &step, pass, colour, begun, &mut since);
                        begun = true;
                    } else if pass.resolve.as_ref().is_some_and(|r| Place::from(r) == chosen.place)
                    {
                        plan.write(&step, "a resolve of another image".to_string());
                    }
                }
                Event::Clear(clear) => {
                    plan.clear(chosen, &step, clear, on.is_some(), &shared, &mut since);
                }
                Event::Write(write) if write.image == chosen.place.image => {
                    plan.write(&step, write.command.clone());
                }
                Event::Write(_) => {}
                Event::Draw(draw) => plan.draw(chosen, &step, draw, on.is_some(), &shared),
            }
        }
        if !depths {
            plan.acts.iter_mut().for_each(|act| {
                if let Act::Draw(planned) = act {
                    planned.for_depth = false;
                }
            });
        }
        // What was painted over, and shows in no depth.
        plan.acts.retain(|act| match act {
            Act::Draw(planned) => {
                planned.records > 0 && (planned.rule.is_some() || planned.for_depth)
            }
            Act::Begin(..) | Act::ClearDepth(..) | Act::Paint(..) => true,
        });
        plan
    }

    /// All that was drawn is gone.
    fn reset(&mut self, base: Base, since: &mut usize) {
        let gone = self.acts.split_off(*since);
        for mut act in gone {
            match &mut act {
                Act::Paint(..) => continue,
                Act::Draw(planned) => {
                    if planned.rule.take().is_some() {
                        self.painted_over.add(planned.records);
                    }
                }
                Act::Begin(..) | Act::ClearDepth(..) => {}
            }
            self.acts.push(act);
        }
        let refused = std::mem::take(&mut self.refused).into_values();
        for [draws, fragments] in refused {
            self.painted_over.draws += draws;
            self.painted_over.fragments += fragments;
        }
        *since = self.acts.len();
        self.depth_alone = Tally::default();
        self.partial_clears = 0;
        self.writes.clear();
        self.written = None;
        self.base = base;
    }

    fn begin(
        &mut self,
        chosen: &Chosen<'_>,
        step: &Step<'_>,
        pass: &'a Pass,
        colour: &'a Attachment,
        begun: bool,
        since: &mut usize,
    ) {
        self.others = self.others.max(pass.others);
        self.attachment.get_or_insert(colour);
        let is_whole = covers(pass.area, chosen.capture.size(chosen.place));
        match vk::AttachmentLoadOp::from_raw(colour.load) {
            vk::AttachmentLoadOp::CLEAR if is_whole || !begun => {
                self.reset(Base::Cleared(colour.clear), since);
                self.partial_clears += u64::from(!is_whole);
            }
            vk::AttachmentLoadOp::CLEAR => self.paint(pass.area, colour.clear),
            vk::AttachmentLoadOp::DONT_CARE if is_whole || !begun => {
                self.reset(Base::Undefined, since);
            }
            // What is loaded, and parts of which nobody cares what was there.
            _ if !begun => self.base = Base::Loaded { submission: step.at.submission },
            _ => {}
        }
    }

    fn clear(
        &mut self,
        chosen: &Chosen<'_>,
        step: &Step<'a>,
        clear: &Clear,
        on: bool,
        shared: &BTreeSet<Place>,
        since: &mut usize,
    ) {
        if clear.depth {
            let depth = step.pass.and_then(|p| p.depth.as_ref());
            if let Some(depth) = depth.filter(|d| shared.contains(&Place::from(*d))) {
                let act = Act::ClearDepth(depth, clear.area, clear.value[0]);
                self.acts.push(act);
            }
        } else if on && covers(clear.area, chosen.capture.size(chosen.place)) {
            self.reset(Base::Cleared(clear.value), since);
        } else if on {
            self.paint(clear.area, clear.value);
        }
    }

    fn paint(&mut self, area: Area, colour: [f32; 4]) {
        self.partial_clears += 1;
        self.acts.push(Act::Paint(area, colour));
    }

    fn write(&mut self, step: &Step<'_>, command: String) {
        let drawn = self.has_fragments();
        if !drawn {
            self.written = Some(step.at.submission);
        }
        *self.writes.entry((drawn, command)).or_default() += 1;
    }

    fn draw(
        &mut self,
        chosen: &Chosen<'_>,
        step: &Step<'a>,
        draw: &'a Draw,
        on: bool,
        shared: &BTreeSet<Place>,
    ) {
        let Some(pass) = step.pass else { return };
        let records = chosen.count(step.at);
        let mut rule = None;
        if on {
            match blend::rule(chosen.capture, pass, draw) {
                Ok(found) if found.is_depth_alone() => self.depth_alone.add(records),
                Ok(found) => rule = Some(found),
                Err(why) => {
                    let [draws, fragments] = self.refused.entry(why).or_default();
                    *draws += 1;
                    *fragments += records;
                }
            }
        }
        let place = pass.depth.as_ref().map(Place::from);
        let is_depth = draw.state.depth_test && draw.state.depth_write;
        if is_depth && !chosen.capture.is_recorded(draw) {
            self.unrecorded.extend(place);
        }
        let for_depth = is_depth && place.is_some_and(|p| shared.contains(&p));
        if rule.is_some() || for_depth {
            let at = step.at;
            self.acts.push(Act::Draw(Planned { at, pass, draw, records, rule, for_depth }));
        }
    }

    /// The draws whose fragments become a trace's.
    pub(crate) fn kept(&self) -> impl Iterator<Item = &Planned<'a>> {
        self.acts.iter().filter_map(|act| match act {
            Act::Draw(planned) if planned.rule.is_some() => Some(planned),
            _ => None,
        })
    }

    fn has_fragments(&self) -> bool {
        self.kept().any(|planned| planned.records > 0)
    }

    /// Whether depths fall with distance, by what most fragments are tested by; and how many are
    /// tested the other way round.
    pub(crate) fn reversed(&self) -> (bool, u64) {
        let mut votes = [0; 2];
        for planned in self.kept().filter(|p| p.tested().is_some()) {
            if let Some(reversed) = is_reversed(planned.draw.state.depth_op) {
                votes[usize::from(reversed)] += planned.records;
            }
        }
        if votes == [0, 0] {
            let cleared = self.kept().filter_map(Planned::tested).next();
            let clear = vk::AttachmentLoadOp::CLEAR.as_raw();
            return (cleared.is_some_and(|d| d.load == clear && d.clear[0] == 0.0), 0);
        }
        (votes[1] > votes[0], votes[0].min(votes[1]))
    }
}

/// The depth images that draws into the chosen place are tested against.
pub(crate) fn shared(chosen: &Chosen<'_>) -> BTreeSet<Place> {
    let mut shared = BTreeSet::new();
    for step in chosen.frame.steps(chosen.capture) {
        if let (Some(pass), Event::Draw(draw)) = (step.pass, step.what)
            && pass.colour.as_ref().is_some_and(|c| Place::from(c) == chosen.place)
            && draw.state.depth_test
        {
            shared.extend(pass.depth.as_ref().map(Place::from));
        }
    }
    shared
}
