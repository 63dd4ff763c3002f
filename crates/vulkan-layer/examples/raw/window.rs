//! A window on an X display.

use std::ffi::{CStr, c_char, c_int, c_uint, c_ulong, c_void};

use ash::vk;

use crate::failure::{Failure, Result};

/// A window of Xlib's, which is opened when the program runs, so that none has to be installed.
pub(crate) struct Window {
    library: *mut c_void,
    pub(crate) display: *mut c_void,
    pub(crate) window: c_ulong,
}

#[cfg(unix)]
unsafe extern "C" {
    fn dlopen(name: *const c_char, flags: c_int) -> *mut c_void;
    fn dlsym(library: *mut c_void, name: *const c_char) -> *mut c_void;
}

/// No X elsewhere.
#[cfg(not(unix))]
unsafe fn dlopen(_: *const c_char, _: c_int) -> *mut c_void {
    std::ptr::null_mut()
}

#[cfg(not(unix))]
unsafe fn dlsym(_: *mut c_void, _: *const c_char) -> *mut c_void {
    std::ptr::null_mut()
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
    pub(crate) fn open(extent: vk::Extent2D) -> Result<Self> {
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

    pub(crate) fn resize(&self, extent: vk::Extent2D) {
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
