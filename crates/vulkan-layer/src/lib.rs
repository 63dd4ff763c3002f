//! A Vulkan layer that records the fragments of any program: of each its pixel, coverage, depth,
//! colour, primitive and draw, without a change to the program's picture.
//!
//! The loader opens it as a library; `screendoor capture --vulkan` says that it should, and makes a
//! trace of what it writes ([`log`]).
//!
//! Three things come together. Fragment shaders are rewritten as pipelines are made, so that they
//! append a record after the program's own text ([`spirv`]). Each draw is given a number, which its
//! records carry, by a descriptor set of our own at the last place that there is. Submissions that
//! are asked for are waited for, and their records and what the command buffers held are written.
//!
//! Nothing of it may reach the program: what fails here is noted, and the call goes on to the driver
//! as it came.

pub mod abi;
mod barriers;
mod batches;
mod commands;
mod counts;
mod creation;
mod device;
mod draws;
mod dynamic;
mod hooks;
mod images;
mod instance;
mod layouts;
pub mod log;
mod memory;
mod objects;
mod own;
mod passes;
mod pending;
mod pictures;
mod pipelines;
mod queues;
mod recorder;
mod rendering;
mod resources;
mod rewrite;
mod sets;
pub mod settings;
pub mod spirv;
mod state;
mod steps;
mod submit;
mod swapchains;
mod table;
mod twins;
mod wire;
mod writes;

use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};

pub use ash::vk;
pub use wire::Wire;

/// Does something of ours; a panic ends here.
fn guard<T>(what: impl FnOnce() -> T) -> Option<T> {
    catch_unwind(AssertUnwindSafe(what)).ok()
}

/// Tells the user something. Standard error may be closed.
fn say(text: &str) {
    let _ = writeln!(std::io::stderr(), "screendoor: {text}");
}

/// What the loader asks of a layer first: its version of the interface and its two functions.
///
/// # Safety
/// Called by Vulkan's loader, which gives a structure that can be written.
#[unsafe(no_mangle)]
pub unsafe extern "system" fn vkNegotiateLoaderLayerInterfaceVersion(
    negotiate: *mut abi::Negotiate,
) -> vk::Result {
    let Some(negotiate) = (unsafe { negotiate.as_mut() }) else {
        return vk::Result::ERROR_INITIALIZATION_FAILED;
    };
    negotiate.version = negotiate.version.min(2);
    negotiate.get_instance = Some(hooks::get_instance_proc_addr);
    negotiate.get_device = Some(hooks::get_device_proc_addr);
    negotiate.get_physical = std::ptr::null();
    vk::Result::SUCCESS
}
