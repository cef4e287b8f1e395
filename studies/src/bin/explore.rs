//! x
use agglo_core::scene::*;
use agglo_studies::progress::Progress;
use agglo_studies::run::*;
use std::time::Instant;
fn main(){
  let which = std::env::args().nth(1).unwrap();
  let seeds: u64 = std::env::args().nth(2).unwrap().parse().unwrap();
  let mut cases=vec![];
  let load=|b:&str,k:u32,seed:u64|{ let text=std::fs::read_to_string(format!("scenes/paper-{b}-{k}e6.json")).unwrap(); let mut s=Scene::parse(&text,&[]).unwrap(); s.seed=seed; s};
  match which.as_str(){
   "paper"=> for b in ["free","binding"]{ for k in [1,2,4,8]{ for s in 1..=seeds { cases.push(Case{label:format!("{b} {k} {s}"),scene:load(b,k,s)})}}},
   "cons"=> for k in [2]{ for dt in [1e-3,1e-3/4.0,1e-3/16.0]{ for s in 1..=seeds { let mut c=load("free",k,s); c.model=ModelKind::Consistent; c.solver=Solver{step:StepSize{fixed:Some(dt),..Default::default()},..Default::default()};
      if let Some(x)=&mut c.contact{x.duration=Some(ImpactDuration::Seconds(1e-5));}
      cases.push(Case{label:format!("cons {k} {dt} {s}"),scene:c})}}},
   "heat"=> for dt in [1e-2,1e-3,1e-4]{ for g in [0.1,0.01,0.001]{ if dt<5e-4 && g!=0.01 {continue;} for s in 1..=seeds { let mut c=load("binding",2,s); c.solver.step.initial=Some(f64::min(dt,1e-3)); c.solver.step.max=Some(dt);
      if let Some(x)=&mut c.contact{x.duration=Some(ImpactDuration::StepFraction(g));}
      cases.push(Case{label:format!("heat {dt} {g} {s}"),scene:c})}}},
   _=>{}
  }
  let p=Progress::new(cases.len());
  for c in &cases { let t=Instant::now(); match run_all(std::slice::from_ref(c),&p){Ok(r)=>{let r=&r[0]; println!("{:24} steps {} it {} rej {} rejit {} imp {} ke {:.4} th {:.1} hot {:.1} cl {:?} res {:.2e} ov {:.2e} {:.2}s",c.label,r.counters.steps,r.counters.iterations,r.counters.rejected_steps,r.rejected_iterations,r.counters.impacts,r.final_kinetic(),r.final_temperature(),r.hottest,r.clusters.as_ref().map(|c|(c.count,c.largest)),r.residual,r.counters.max_overlap,t.elapsed().as_secs_f64())},Err(e)=>println!("{e}")}}
}
