//! Processes that start others, and that end in other ways than most.

use std::ffi::c_int;
use std::os::unix::process::CommandExt;
use std::process::Command;

use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
use crate::host::Host;
use crate::target::TargetPlan;
use crate::{Call, draw};

unsafe extern "C" {
    fn raise(signal: c_int) -> c_int;
    fn fork() -> c_int;
    fn waitpid(process: c_int, status: *mut c_int, options: c_int) -> c_int;
}

/// Ends this process with no chance to say anything.
pub(super) fn kill<T>() -> Result<T> {
    const SIGKILL: c_int = 9;
    // SAFETY: nothing comes after it.
    unsafe { raise(SIGKILL) };
    Err(Failure::Failed("still alive".into()))
}

fn this_program(case: &str, call: &Call) -> Result<Command> {
    let mut command = Command::new(std::env::current_exe()?);
    command.arg(case).arg(&call.out);
    Ok(command)
}

/// This program again as a child, which draws.
pub(super) fn child(call: &Call) -> Result<()> {
    let status = this_program("plain", call)?.status()?;
    if status.success() { Ok(()) } else { Err(Failure::Failed(format!("the child: {status}"))) }
}

/// A copy of this process draws; this one had an instance and a device first, and draws nothing.
pub(super) fn forked(call: &Call) -> Result<()> {
    // The device is gone before, and with it the driver's threads, which a copy would lack.
    drop(Gpu::plain()?);
    let host = Host::new()?;
    // SAFETY: this process has one thread.
    let child = unsafe { fork() };
    if child == 0 {
        std::process::exit(i32::from(draw("plain", call).is_err()));
    }
    let mut status = 0;
    // SAFETY: `status` outlives the call.
    let ended = unsafe { waitpid(child, &raw mut status, 0) };
    drop(host);
    if child > 0 && ended == child && status == 0 {
        Ok(())
    } else {
        Err(Failure::Failed(format!("the copy: {status}")))
    }
}

/// This process becomes another program, which draws.
pub(super) fn launcher(call: &Call) -> Result<()> {
    drop(Host::new()?);
    Err(this_program("plain", call)?.exec().into())
}

/// Nothing is destroyed.
pub(super) fn exit_without_destroy(call: &Call) -> Result<()> {
    let gpu = std::mem::ManuallyDrop::new(Gpu::plain()?);
    let picture = super::drawn(&gpu, TargetPlan::default(), |plan| plan)?;
    std::fs::write(&call.out, picture)?;
    std::process::exit(0)
}
