//! Where frames can be shown: a surface without a window, or an X window.

use std::ffi::CStr;
use std::rc::Rc;

use ash::vk;

use crate::failure::{Failure, Result};
use crate::host::Host;
use crate::window::Window;

pub(crate) struct Surface {
    pub(crate) handle: vk::SurfaceKHR,
    pub(crate) calls: ash::khr::surface::Instance,
    window: Option<Window>,
    /// The surface goes before its instance.
    host: Rc<Host>,
}

impl Surface {
    /// An instance with a surface, or without where the system has none.
    pub(crate) fn open(extent: vk::Extent2D) -> Result<(Rc<Host>, Option<Self>)> {
        for make in [Self::headless, Self::window] {
            match make(extent) {
                Ok(surface) => return Ok((surface.host.clone(), Some(surface))),
                Err(Failure::Unsupported(_)) => {}
                Err(failure) => return Err(failure),
            }
        }
        Ok((Host::new()?, None))
    }

    fn host(kind: &CStr) -> Result<(Rc<Host>, ash::khr::surface::Instance)> {
        let host = Host::with(vk::API_VERSION_1_1, &[ash::khr::surface::NAME, kind])?;
        let calls = ash::khr::surface::Instance::new(&host.entry, &host.instance);
        Ok((host, calls))
    }

    fn headless(_: vk::Extent2D) -> Result<Self> {
        let (host, calls) = Self::host(ash::ext::headless_surface::NAME)?;
        let make = ash::ext::headless_surface::Instance::new(&host.entry, &host.instance);
        let info = vk::HeadlessSurfaceCreateInfoEXT::default();
        // SAFETY: the instance was made with the extension.
        let handle = unsafe { make.create_headless_surface(&info, None) }?;
        Self { handle, calls, window: None, host }.usable()
    }

    fn window(extent: vk::Extent2D) -> Result<Self> {
        let window = Window::open(extent)?;
        let (host, calls) = Self::host(ash::khr::xlib_surface::NAME)?;
        let make = ash::khr::xlib_surface::Instance::new(&host.entry, &host.instance);
        let info =
            vk::XlibSurfaceCreateInfoKHR::default().dpy(window.display).window(window.window);
        // SAFETY: the window lives as long as the surface.
        let handle = unsafe { make.create_xlib_surface(&info, None) }?;
        Self { handle, calls, window: Some(window), host }.usable()
    }

    /// If the first queue family can present.
    fn usable(self) -> Result<Self> {
        let physical = self.host.physical;
        // SAFETY: the surface is the instance's.
        let there =
            unsafe { self.calls.get_physical_device_surface_support(physical, 0, self.handle) }?;
        if there { Ok(self) } else { Err(Failure::unsupported("presentation")) }
    }

    pub(crate) fn resize(&self, extent: vk::Extent2D) {
        if let Some(window) = &self.window {
            window.resize(extent);
        }
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: no swapchain is left.
        unsafe { self.calls.destroy_surface(self.handle, None) }
    }
}
