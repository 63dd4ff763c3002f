//! Where frames can be shown: a surface without a window, or an X window.

use std::ffi::{CStr, c_char, c_int, c_uint, c_ulong, c_void};
use std::rc::Rc;

use ash::vk;

use crate::failure::{Failure, Result};
use crate::host::Host;

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

/// A window of Xlib's, which is opened when the program runs, so that none has to be installed.
struct Window {
    library: *mut c_void,
    display: *mut c_void,
    window: c_ulong,
}

unsafe extern "C" {
    fn dlopen(name: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

type OpenDisplay = unsafe extern "C" fn(*const c_char) -> *mut c_void;
type RootWindow = unsafe extern "C" fn(*mut c_void) -> c_ulong;
type CreateWindow = unsafe extern "C" fn(
    *mut c_void,
    c_ulong,
    c_int,
    c_int,
    c_uint,
    c_uint,
    c_uint,
    c_ulong,
    c_ulong,
) -> c_ulong;
type Resize = unsafe extern "C" fn(*mut c_void, c_ulong, c_uint, c_uint) -> c_int;
type MapWindow = unsafe extern "C" fn(*mut c_void, c_ulong) -> c_int;
type Sync = unsafe extern "C" fn(*mut c_void, c_int) -> c_int;
type Close = unsafe extern "C" fn(*mut c_void) -> c_int;

/// A function of a library.
///
/// # Safety
/// The library has it with the type `T`, a function's.
unsafe fn call<T: Copy>(library: *mut c_void, name: &CStr) -> Result<T> {
    // SAFETY: a null is told from a function before it is taken for one.
    unsafe {
        let at = dlsym(library, name.as_ptr());
        if at.is_null() {
            return Err(Failure::unsupported("Xlib"));
        }
        Ok(std::mem::transmute_copy(&at))
    }
}

impl Window {
    fn open(extent: vk::Extent2D) -> Result<Self> {
        // SAFETY: the functions have these types in every version of Xlib.
        unsafe {
            let library = dlopen(c"libX11.so.6".as_ptr(), 1);
            if library.is_null() {
                return Err(Failure::unsupported("Xlib"));
            }
            let open: OpenDisplay = call(library, c"XOpenDisplay")?;
            let root: RootWindow = call(library, c"XDefaultRootWindow")?;
            let create: CreateWindow = call(library, c"XCreateSimpleWindow")?;
            let map: MapWindow = call(library, c"XMapWindow")?;
            let sync: Sync = call(library, c"XSync")?;
            let display = open(std::ptr::null());
            if display.is_null() {
                return Err(Failure::unsupported("no display"));
            }
            let (width, height) = (extent.width, extent.height);
            let window = create(display, root(display), 0, 0, width, height, 0, 0, 0);
            map(display, window);
            sync(display, 0);
            Ok(Self { library, display, window })
        }
    }

    fn resize(&self, extent: vk::Extent2D) {
        // SAFETY: the functions have these types in every version of Xlib.
        unsafe {
            let resize = call::<Resize>(self.library, c"XResizeWindow");
            let sync = call::<Sync>(self.library, c"XSync");
            if let (Ok(resize), Ok(sync)) = (resize, sync) {
                resize(self.display, self.window, extent.width, extent.height);
                sync(self.display, 0);
            }
        }
    }
}

impl Drop for Window {
    fn drop(&mut self) {
        // SAFETY: the surface is gone; the display takes its window along.
        unsafe {
            if let Ok(close) = call::<Close>(self.library, c"XCloseDisplay") {
                close(self.display);
            }
        }
    }
}
