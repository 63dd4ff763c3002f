//! Temporary: fragments a second and content hashes of captures.
use screendoor_scene::capture::{Capture, CaptureOptions, SplatRules};
use screendoor_trace::trace::{TraceWriter, WriteOptions};
use std::io::Write;
use std::time::Instant;

fn main() {
    let args: Vec<String> = std::env::args().collect();
    let reps: usize = args[1].parse().unwrap();
    let size: u32 = args[2].parse().unwrap();
    let threads: usize = args[3].parse().unwrap();
    let samples: Vec<u32> = args[4].split(',').map(|s| s.parse().unwrap()).collect();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    for spec in &args[5..] {
        let (name, rules) = spec.split_once('@').unwrap_or((spec, "inria"));
        let scene = screendoor_scene::scene::load(name).unwrap();
        for &samples in &samples {
            let mut options =
                CaptureOptions { width: size, height: size, samples, ..Default::default() };
            options.splats = SplatRules::parse(rules).unwrap();
            let capture = Capture::new(&scene, &options).unwrap();
            let mut times = vec![];
            let mut last = None;
            for _ in 0..reps {
                let t = Instant::now();
                let w = pool.install(|| {
                    let mut w = TraceWriter::new(
                        Null,
                        "x",
                        capture.header().clone(),
                        WriteOptions::default(),
                    )
                    .unwrap();
                    capture.draw(&mut w, |_, _| ()).unwrap();
                    w.finish().unwrap().1
                });
                times.push(t.elapsed().as_secs_f64());
                last = Some(w);
            }
            times.sort_by(f64::total_cmp);
            let w = last.unwrap();
            let t = times[times.len() / 2];
            println!(
                "{spec} s{samples} t{threads} rows {} ms {:.1} M/s {:.3} {} {}",
                w.rows,
                t * 1e3,
                w.rows as f64 / t / 1e6,
                &w.content[..16],
                w.bytes
            );
        }
    }
}
struct Null;
impl Write for Null {
    fn write(&mut self, b: &[u8]) -> std::io::Result<usize> {
        Ok(b.len())
    }
    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
