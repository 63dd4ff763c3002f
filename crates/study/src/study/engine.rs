//! What draws: this machine's processor or a GPU.

use serde::de::Error as _;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use screendoor_designs::Configured;
use screendoor_gpu::{self as gpu, Adapter, Gpu, GpuOptions, GpuSeconds, Threads};
use screendoor_rop::{Implementation, ReplayOptions, Replayed};
use screendoor_trace::error::{Error, Result};
use screendoor_trace::param::{Choice, Options};
use screendoor_trace::trace::Trace;

/// An engine by its name.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum EngineName {
    /// This machine's processor.
    Cpu(Implementation),
    /// A GPU.
    Gpu,
}

const GPU: Choice = Choice { name: "gpu", help: "a GPU, for designs that have a port to it" };

impl EngineName {
    /// All engines, with their names and what they are.
    pub fn all() -> impl Iterator<Item = (Self, Choice)> {
        let of_cpu = Implementation::ALL.iter().zip(Implementation::CHOICES);
        let of_cpu =
            of_cpu.map(|(implementation, choice)| (EngineName::Cpu(*implementation), *choice));
        of_cpu.chain([(EngineName::Gpu, GPU)])
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            EngineName::Cpu(implementation) => {
                Implementation::CHOICES[implementation as usize].name
            }
            EngineName::Gpu => GPU.name,
        }
    }

    /// Makes it ready.
    ///
    /// # Errors
    /// As [`Gpu::open`]; [`Error::Config`] for an adapter that nothing runs on.
    pub fn open(self, adapter: Option<&str>) -> Result<Engine> {
        match (self, adapter) {
            (EngineName::Cpu(implementation), None) => Ok(Engine::Cpu(implementation)),
            (EngineName::Cpu(_), Some(_)) => Err(Error::config(
                format_args!("an adapter was named, and the engine is '{}'", self.name()),
                "add --engine gpu, or leave --adapter out",
            )),
            (EngineName::Gpu, adapter) => {
                Ok(Engine::Gpu(Box::new(Gpu::open(adapter)?), Threads::Pixel))
            }
        }
    }
}

impl Serialize for EngineName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.name())
    }
}

impl<'de> Deserialize<'de> for EngineName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        let named = EngineName::all().find(|(_, choice)| choice.name == name);
        named.map(|(engine, _)| engine).ok_or_else(|| {
            let known: Vec<String> =
                EngineName::all().map(|(_, choice)| format!("`{}`", choice.name)).collect();
            D::Error::custom(format_args!(
                "unknown variant `{name}`, expected one of {}",
                known.join(", ")
            ))
        })
    }
}

/// An engine that is ready.
pub enum Engine {
    /// This machine's processor.
    Cpu(Implementation),
    /// A GPU, open, and what its threads are given.
    Gpu(Box<Gpu>, Threads),
}

/// This machine's processor, as fast as it can.
pub const FAST: &Engine = &Engine::Cpu(Implementation::Fast);

/// What a GPU says of a replay.
#[derive(Clone, Debug, Serialize)]
pub struct OnGpu {
    /// Which.
    pub adapter: Adapter,
    /// Where the time went.
    #[serde(flatten)]
    pub seconds: GpuSeconds,
    /// Drawn, over all passes.
    #[serde(skip)]
    pub fragments: u64,
}

impl Engine {
    /// The same, threads of a GPU given pixels or samples.
    pub fn with_threads(self, threads: Threads) -> Self {
        match self {
            Engine::Gpu(gpu, _) => Engine::Gpu(gpu, threads),
            other => other,
        }
    }

    /// The GPU, if it is one.
    pub fn adapter(&self) -> Option<&Adapter> {
        match self {
            Engine::Cpu(_) => None,
            Engine::Gpu(gpu, _) => Some(gpu.adapter()),
        }
    }

    /// Replays a trace; `options` name another engine, which is not asked.
    ///
    /// # Errors
    /// As [`Configured::replay`] and [`gpu::replay`].
    pub fn replay(
        &self,
        design: &Configured,
        trace: &Trace,
        samples: u32,
        seed: u32,
        options: &ReplayOptions<'_>,
    ) -> Result<(Replayed, Option<OnGpu>)> {
        match self {
            Engine::Cpu(implementation) => {
                let options = ReplayOptions { implementation: *implementation, ..*options };
                Ok((design.replay(trace, samples, seed, &options)?, None))
            }
            Engine::Gpu(gpu, threads) => {
                let options = GpuOptions {
                    threads: *threads,
                    keep: options.keep,
                    progress: options.progress,
                    ..GpuOptions::default()
                };
                let (replayed, seconds, fragments) =
                    gpu::replay(gpu, design, trace, samples, seed, &options)?;
                let adapter = gpu.adapter().clone();
                Ok((replayed, Some(OnGpu { adapter, seconds, fragments })))
            }
        }
    }
}
