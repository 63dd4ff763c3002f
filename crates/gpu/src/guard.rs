//! Talking to a device so that what goes wrong there is an error, on our own device and on
//! anybody's: whatever is asked of it stands within error scopes, so that no handler of the
//! device's owner is needed or replaced.

use std::fmt::Display;
use std::ops::Range;
use std::sync::{Arc, Mutex, mpsc};
use std::time::Duration;

use screendoor_trace::error::{Error, Result};

/// How long a device may take to say why it failed.
const PATIENCE: Duration = Duration::from_secs(5);

/// Makes errors of what a device says.
#[derive(Clone, Debug)]
pub(crate) struct Guard {
    /// Whose errors they are.
    name: String,
    /// Why the device was lost, where it told so.
    lost: Arc<Mutex<Option<String>>>,
}

impl Guard {
    /// Of the device that errors call `name`.
    pub(crate) fn new(name: impl Display) -> Self {
        Guard { name: name.to_string(), lost: Arc::default() }
    }

    /// Has the device tell when it is lost. A device has room for one such callback, so that
    /// this is for devices of our own.
    pub(crate) fn watch(&self, device: &wgpu::Device) {
        let lost = self.lost.clone();
        device.set_device_lost_callback(move |_, why| {
            // The first reason is the cause of the others.
            lost.lock().expect("no thread panicked").get_or_insert(why);
        });
    }

    /// An error of this device.
    pub(crate) fn error(&self, what: impl Display, hint: impl Display) -> Error {
        Error::gpu(&self.name, what, hint)
    }

    /// Runs `work`; what the device says against it becomes an error.
    ///
    /// # Errors
    /// [`Error::Gpu`] with what the device said.
    pub(crate) fn run<T>(
        &self,
        device: &wgpu::Device,
        doing: &str,
        work: impl FnOnce() -> T,
    ) -> Result<T> {
        use wgpu::ErrorFilter::{Internal, OutOfMemory, Validation};
        let scopes = [OutOfMemory, Internal, Validation].map(|f| device.push_error_scope(f));
        let made = work();
        // The inner ones first.
        let said = scopes.into_iter().rev().map(|scope| pollster::block_on(scope.pop()));
        let said: Vec<wgpu::Error> = said.flatten().collect();
        self.check(doing)?;
        // Where memory was short, that is the cause of the others.
        let memory = said.iter().find(|e| matches!(e, wgpu::Error::OutOfMemory { .. }));
        match memory.or(said.first()) {
            None => Ok(made),
            Some(wgpu::Error::OutOfMemory { .. }) => Err(self.error(
                format_args!("its memory is full ({doing})"),
                "close other programs, or ask for less at a time: fewer samples, smaller buffers",
            )),
            Some(other) => Err(self.error(
                format_args!("{doing} failed: {other}"),
                "this is a fault of screendoor, of a shader or of the driver: do without the GPU",
            )),
        }
    }

    /// Whether the device is still there, as far as it told.
    ///
    /// # Errors
    /// [`Error::Gpu`] where it was lost.
    fn check(&self, doing: &str) -> Result<()> {
        match self.lost.lock().expect("no thread panicked").as_deref() {
            None => Ok(()),
            Some(why) => Err(self.error(
                match why {
                    "" => format!("it was lost ({doing})"),
                    why => format!("it was lost ({doing}): {why}"),
                },
                "try again; if it happens again, look at the system's log and its driver",
            )),
        }
    }

    /// Why memory could not be reached: that the device was lost, if it knows.
    pub(crate) fn failed(&self, device: &wgpu::Device, doing: &str, why: impl Display) -> Error {
        // A device tells that it is lost when it is asked, and when its last work is over.
        let wait = wgpu::PollType::Wait { submission_index: None, timeout: Some(PATIENCE) };
        let polled = device.poll(wait);
        let cause = self.check(doing).err();
        let again = "try again; if it happens again, look at the system's log and the driver";
        cause.unwrap_or_else(|| match polled {
            Err(e) => self.error(format_args!("{doing} failed: {e}"), again),
            Ok(_) => self.error(format_args!("{doing} failed: {why}"), again),
        })
    }

    /// Waits until everything is done.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device was lost.
    pub(crate) fn wait(&self, device: &wgpu::Device, doing: &str) -> Result<()> {
        let polled = device.poll(wgpu::PollType::wait_indefinitely());
        self.check(doing)?;
        polled.map_err(|e| self.failed(device, doing, e))?;
        Ok(())
    }

    /// Brings a part of a buffer back, once all that was submitted is done, and hands it to
    /// `look`.
    ///
    /// # Errors
    /// [`Error::Gpu`] where the device was lost or has no memory for that.
    pub(crate) fn read<T>(
        &self,
        (device, queue): (&wgpu::Device, &wgpu::Queue),
        (buffer, part): (&wgpu::Buffer, Range<u64>),
        doing: &str,
        look: impl FnOnce(&[u32]) -> T,
    ) -> Result<T> {
        let size = part.end - part.start;
        let (sender, receiver) = mpsc::channel();
        let copy = self.run(device, doing, || {
            let copy = device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("what comes back"),
                size,
                usage: wgpu::BufferUsages::MAP_READ | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            });
            let mut encoder = device.create_command_encoder(&Default::default());
            encoder.copy_buffer_to_buffer(buffer, part.start, &copy, 0, size);
            queue.submit([encoder.finish()]);
            copy.map_async(wgpu::MapMode::Read, .., move |result| {
                // Nobody waits any more where waiting has failed.
                let _ = sender.send(result);
            });
            copy
        })?;
        self.wait(device, doing)?;
        let failed = |why: &dyn Display| self.failed(device, doing, why);
        receiver.recv().map_err(|e| failed(&e))?.map_err(|e| failed(&e))?;
        let view = copy.get_mapped_range(..).map_err(|e| failed(&e))?;
        Ok(look(bytemuck::cast_slice(&view)))
    }
}
