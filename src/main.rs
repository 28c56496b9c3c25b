//! x
#![allow(clippy::print_stdout, clippy::unwrap_used)]
fn main(){
 let name=std::env::args().nth(1).unwrap();
 let scene=glimt::scene::built_in(&name).unwrap();
 let o=glimt::render::Options{validate:std::env::var("VAL").is_ok(),samples:std::env::var("SPP").map_or(1,|v|v.parse().unwrap()), ..Default::default()};
 match glimt::render::render(&scene,&o) { Ok((film,report))=>{ println!("{}", report.text()); println!("{:#?}",report.passes);
  film.save(std::path::Path::new("/tmp/o.png"), glimt::film::Format::Png8, ||Ok(())).unwrap(); } Err(e)=>println!("{e}") }
}
