//! State that a program sets while it records: what of it decides what becomes of fragments.

use ash::vk;

use crate::abi::slice;
use crate::commands::with;
use crate::device::{SETTINGS, device};
use crate::log::State;
use crate::table::next;

/// Which of a pipeline's state is set by commands, and by them to what. Bits as they come.
#[derive(Clone, Copy, Default)]
pub(crate) struct Dynamic {
    pub blend: Option<bool>,
    pub equation: Option<[i32; 6]>,
    pub mask: Option<u32>,
    pub write: Option<bool>,
    pub constants: Option<[f32; 4]>,
    pub logic_op: Option<bool>,
    pub alpha_to_coverage: Option<bool>,
    pub alpha_to_one: Option<bool>,
    pub depth_test: Option<bool>,
    pub depth_write: Option<bool>,
    pub depth_op: Option<i32>,
    pub stencil_test: Option<bool>,
    pub stencil_fails: Option<bool>,
    pub bounds: Option<bool>,
}

/// A pipeline's state, of which some parts are dynamic.
#[derive(Clone, Default)]
pub(crate) struct Static {
    pub state: State,
    pub stencil_test: bool,
    pub stencil_fails: bool,
    /// A bounds test of depth.
    pub bounds: bool,
    pub dynamic: Vec<vk::DynamicState>,
}

impl Static {
    /// Whether commands have a draw's alpha replaced by 1.
    pub(crate) fn alpha_to_one(&self, set: &Dynamic) -> bool {
        let dynamic = self.dynamic.contains(&vk::DynamicState::ALPHA_TO_ONE_ENABLE_EXT);
        dynamic && set.alpha_to_one == Some(true)
    }

    /// As it is for a draw.
    pub(crate) fn with(&self, set: &Dynamic) -> State {
        use vk::DynamicState as D;
        let is = |which: D| self.dynamic.contains(&which);
        let mut state = self.state.clone();
        let (mut test, mut fails) = (self.stencil_test, self.stencil_fails);
        let mut bounds = self.bounds;
        let put = |which: D, target: &mut bool, value: Option<bool>| {
            if is(which) {
                *target = value.unwrap_or(*target);
            }
        };
        put(D::COLOR_BLEND_ENABLE_EXT, &mut state.blend, set.blend);
        put(D::LOGIC_OP_ENABLE_EXT, &mut state.logic_op, set.logic_op);
        let coverage = &mut state.alpha_to_coverage;
        put(D::ALPHA_TO_COVERAGE_ENABLE_EXT, coverage, set.alpha_to_coverage);
        put(D::DEPTH_TEST_ENABLE, &mut state.depth_test, set.depth_test);
        put(D::DEPTH_WRITE_ENABLE, &mut state.depth_write, set.depth_write);
        put(D::STENCIL_TEST_ENABLE, &mut test, set.stencil_test);
        put(D::STENCIL_OP, &mut fails, set.stencil_fails);
        put(D::DEPTH_BOUNDS_TEST_ENABLE, &mut bounds, set.bounds);
        if let Some([s, d, op, sa, da, opa]) =
            set.equation.filter(|_| is(D::COLOR_BLEND_EQUATION_EXT))
        {
            (state.source, state.destination, state.op) = (s, d, op);
            (state.source_alpha, state.destination_alpha, state.op_alpha) = (sa, da, opa);
        }
        if let Some(mask) = set.mask.filter(|_| is(D::COLOR_WRITE_MASK_EXT)) {
            state.mask = mask;
        }
        if is(D::COLOR_WRITE_ENABLE_EXT) && set.write == Some(false) {
            state.mask = 0;
        }
        if let Some(constants) = set.constants.filter(|_| is(D::BLEND_CONSTANTS)) {
            state.constants = constants;
        }
        if let Some(op) = set.depth_op.filter(|_| is(D::DEPTH_COMPARE_OP)) {
            state.depth_op = op;
        }
        state.stencil = test && fails || bounds;
        state
    }
}

/// The value that commands for attachments from `first` on give the one asked for.
unsafe fn ours<T: Copy>(first: u32, n: u32, values: *const T) -> Option<T> {
    let at = SETTINGS.location.checked_sub(first)?;
    unsafe { slice(values, n).get(at as usize).copied() }
}

/// Hooks of commands that set one value.
macro_rules! setters {
    ($($hook:ident: $next:ident, $field:ident, |$value:ident: $t:ty| $stored:expr;)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(buffer: vk::CommandBuffer, $value: $t) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            with(&d, buffer, |commands| commands.dynamic.$field = Some($stored));
            next!(d.table.$next, buffer, $value)
        }
    )*};
}

setters! {
    depth_test: set_depth_test, depth_test, |value: vk::Bool32| value == vk::TRUE;
    depth_write: set_depth_write, depth_write, |value: vk::Bool32| value == vk::TRUE;
    depth_op: set_depth_op, depth_op, |value: vk::CompareOp| value.as_raw();
    stencil_test: set_stencil_test, stencil_test, |value: vk::Bool32| value == vk::TRUE;
    bounds: set_bounds, bounds, |value: vk::Bool32| value == vk::TRUE;
    logic_op: set_logic_op, logic_op, |value: vk::Bool32| value == vk::TRUE;
    alpha_to_one: set_alpha_to_one, alpha_to_one, |value: vk::Bool32| value == vk::TRUE;
    alpha_to_coverage: set_alpha_to_coverage, alpha_to_coverage, |value: vk::Bool32| value == vk::TRUE;
}

/// Hooks of commands that set a value for each of several attachments.
macro_rules! attachment_setters {
    ($($hook:ident: $next:ident, $field:ident, |$value:ident: $t:ty| $stored:expr;)*) => {$(
        pub(crate) unsafe extern "system" fn $hook(
            buffer: vk::CommandBuffer,
            first: u32,
            n: u32,
            values: *const $t,
        ) {
            let Some(d) = (unsafe { device(buffer) }) else { return };
            if let Some($value) = unsafe { ours(first, n, values) } {
                with(&d, buffer, |commands| commands.dynamic.$field = Some($stored));
            }
            next!(d.table.$next, buffer, first, n, values)
        }
    )*};
}

attachment_setters! {
    blend_enable: set_blend_enable, blend, |value: vk::Bool32| value == vk::TRUE;
    blend_equation: set_blend_equation, equation, |value: vk::ColorBlendEquationEXT| [
        value.src_color_blend_factor.as_raw(),
        value.dst_color_blend_factor.as_raw(),
        value.color_blend_op.as_raw(),
        value.src_alpha_blend_factor.as_raw(),
        value.dst_alpha_blend_factor.as_raw(),
        value.alpha_blend_op.as_raw(),
    ];
    // Of the advanced operations none is a plain blend: the operation's number says so.
    blend_advanced: set_blend_advanced, equation, |value: vk::ColorBlendAdvancedEXT| [
        0, 0, value.advanced_blend_op.as_raw(), 0, 0, value.advanced_blend_op.as_raw(),
    ];
    write_mask: set_write_mask, mask, |value: vk::ColorComponentFlags| value.as_raw();
}

pub(crate) unsafe extern "system" fn write_enable(
    buffer: vk::CommandBuffer,
    n: u32,
    values: *const vk::Bool32,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    if let Some(value) = unsafe { ours(0, n, values) } {
        with(&d, buffer, |commands| commands.dynamic.write = Some(value == vk::TRUE));
    }
    next!(d.table.set_write_enable, buffer, n, values)
}

pub(crate) unsafe extern "system" fn blend_constants(
    buffer: vk::CommandBuffer,
    constants: *const [f32; 4],
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let value = unsafe { *constants };
    with(&d, buffer, |commands| commands.dynamic.constants = Some(value));
    next!(d.table.blend_constants, buffer, constants)
}

pub(crate) unsafe extern "system" fn stencil_op(
    buffer: vk::CommandBuffer,
    faces: vk::StencilFaceFlags,
    fail: vk::StencilOp,
    pass: vk::StencilOp,
    depth_fail: vk::StencilOp,
    compare: vk::CompareOp,
) {
    let Some(d) = (unsafe { device(buffer) }) else { return };
    let fails = compare != vk::CompareOp::ALWAYS;
    with(&d, buffer, |commands| {
        // Of either face: one of them is enough.
        let other = faces != vk::StencilFaceFlags::FRONT_AND_BACK
            && commands.dynamic.stencil_fails == Some(true);
        commands.dynamic.stencil_fails = Some(fails || other);
    });
    next!(d.table.set_stencil_op, buffer, faces, fail, pass, depth_fail, compare)
}
