//! Processes that start others, and that end in other ways than most.

use std::ffi::c_int;
use std::process::Command;

use crate::Call;
#[cfg(unix)]
use crate::draw;
use crate::failure::{Failure, Result};
use crate::gpu::Gpu;
#[cfg(unix)]
use crate::host::Host;
use crate::target::TargetPlan;

unsafe extern "C" {
    fn raise(signal: c_int) -> c_int;
}

#[cfg(unix)]
unsafe extern "C" {
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

/// Neither copies of a process nor programs in place of others.
#[cfg(not(unix))]
pub(super) fn forked(_: &Call) -> Result<()> {
    Err(Failure::unsupported("not on this system"))
}

#[cfg(not(unix))]
pub(super) use forked as launcher;

/// A copy of this process draws; this one had an instance and a device first, and draws nothing.
#[cfg(unix)]
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
#[cfg(unix)]
pub(super) fn launcher(call: &Call) -> Result<()> {
    use std::os::unix::process::CommandExt;
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
