use super::{camera::*, edge_curve::EdgeCurve, evidence::*, search};
use nalgebra::Rotation3;
use std::f64::consts::FRAC_PI_2;

pub struct Out { pub evidence: f64, pub radii: Vec<f64>, pub center: [f64;2], pub down: [f64;3], pub shares: Vec<f64>, pub k: [f64;3], pub f: f64, pub n: usize, pub explained: Vec<f64>, pub rim: f64, pub sig_radius: f64, pub sig_center: f64, pub sig_level: f64 , pub headings: Vec<f64>}

pub fn radii(c:&RoomCamera)->Vec<f64>{ (2..=8).map(|d| { let t=(d as f64*10.0).to_radians(); c.focal*c.curve(t).0 }).collect() }
fn out(c:&RoomCamera,e:&Evaluation,n:usize,prior:&Prior)->Out{
    let d=c.room*nalgebra::Vector3::z();
    let cov=e.normal.clone().try_inverse();
    let (mut sr,mut sc,mut sl)=(9.0,9.0,9.0);
    if let Some(cov)=cov { sl=((cov[(5,5)]+cov[(6,6)])/1.0).sqrt().to_degrees(); sc=(cov[(3,3)]+cov[(4,4)]).sqrt();
        sr=0.0; for dd in 2..=8 { let t=(dd as f64*10.0f64).to_radians(); let (g,_)=c.curve(t); let id=ideal_shape_slope(c.k1); let j=[1.0,(t.powi(3)*(id[0]+t*t*(id[1]+t*t*id[2])))/g,t.powi(5)/g]; let mut v=0.0; for a in 0..3{for b in 0..3{v+=j[a]*j[b]*cov[(a,b)];}} sr=f64::max(sr,v.sqrt()); } }
    Out{evidence:e.evidence,radii:radii(c),center:c.center,down:[d.x,d.y,d.z],shares:e.shares.clone(),k:c.shape(),f:c.focal,n,explained:e.explained.clone(),rim:c.theta(prior.radius).unwrap_or(0.0).to_degrees(),sig_radius:sr,sig_center:sc,sig_level:sl,headings:c.headings.clone()}
}
pub fn distance(a:&Out,b:&Out)->(f64,f64){ let r=a.radii.iter().zip(&b.radii).map(|(x,y)|(x/y-1.0).abs()).fold(0.0,f64::max); let l=(0..3).map(|i|a.down[i]*b.down[i]).sum::<f64>().min(1.0).acos().to_degrees(); (r,l)}

pub fn truth(curves:&[EdgeCurve],center:[f64;2],center_sigma:f64,radius:f64,tc:[f64;2],down:[f64;3],fk:[f64;3])->Option<Out>{
    let prior=Prior{center,center_sigma,radius,k2_sigma:ev("K2S",0.003),rim:(FRAC_PI_2,ev("RIM",0.22))};
    let ones=vec![1.0;curves.len()];
    let d=nalgebra::Vector3::from(down); let a=nalgebra::Vector3::y().cross(&d).normalize(); let b=d.cross(&a);
    let mut best:Option<(RoomCamera,Evaluation)>=None;
    for h in 0..90 { let h=(h as f64).to_radians(); let x=a*h.cos()+b*h.sin(); let room=Rotation3::from_matrix_unchecked(nalgebra::Matrix3::from_columns(&[x,d.cross(&x),d]));
      let c=RoomCamera{focal:fk[0],k1:fk[1],k2_offset:fk[2]-ideal_shape(fk[1])[1],center:tc,room,headings:vec![]};
      let Some(e)=evaluate(&c,curves,&ones,&prior,1.0,true) else {continue}; if best.as_ref().is_none_or(|b|e.evidence>b.1.evidence){best=Some((c,e));} }
    let (c,e)=best?; Some(out(&c,&e,curves.len(),&prior)) }
pub fn fit(curves:&[EdgeCurve],center:[f64;2],center_sigma:f64,radius:f64)->Vec<Out>{
    let prior=Prior{center,center_sigma,radius,k2_sigma:ev("K2S",0.003),rim:(FRAC_PI_2,ev("RIM",0.22))};
    let starts=search::starts(curves,&prior,None);
    let mut longest=curves.to_vec(); longest.sort_by(|a,b|b.points.len().cmp(&a.points.len())); longest.truncate(300);
    let ones=vec![1.0;curves.len()];
    let mut coarse=vec![];
    let mut used:Vec<(f64,nalgebra::Vector3<f64>)>=vec![];
    for s in starts.into_iter() {
        if coarse.len()>=12 {break;}
        let _=&mut used;
        let Some((c,_))=climb(s.camera,&longest,&ones,&prior,6.0,5) else {continue};
        let Some((c,_))=climb(c,&longest,&ones,&prior,3.0,5) else {continue};
        let Some((c,e))=climb(c,&longest,&ones,&prior,1.5,6) else {continue};
        coarse.push((c,e));
    }
    coarse.sort_by(|a,b|b.1.evidence.total_cmp(&a.1.evidence));
    let mut outs:Vec<(RoomCamera,Out)>=vec![];
    for (c,_) in coarse { 
        let probe=radii(&c); let d=c.room*nalgebra::Vector3::z();
        if outs.iter().any(|(_,o)| o.radii.iter().zip(&probe).all(|(x,y)|(x/y-1.0).abs()<0.01) && (o.down[0]*d.x+o.down[1]*d.y+o.down[2]*d.z)>0.9998) {continue;}
        if outs.len()>=4 {break;}
        let Some((c,e))=climb(c,curves,&ones,&prior,1.5,4) else {continue};
        let Some((c,e2))=climb(c,curves,&ones,&prior,1.0,12) else {let _=e;continue};
        let o=out(&c,&e2,curves.len(),&prior); outs.push((c,o));
    }
    outs.sort_by(|a,b|b.1.evidence.total_cmp(&a.1.evidence));
    // further headings of the best
    if std::env::var("HEAD").is_ok() { if let Some((c,_))=outs.first() {
        let mut best=None;
        let base=outs[0].1.evidence;
        for h in 1..30 { let mut t=c.clone(); t.headings.push(FRAC_PI_2*h as f64/30.0); if let Some((c2,e2))=climb(t,curves,&ones,&prior,1.0,3) { if best.as_ref().map_or(true,|(_,e):&(RoomCamera,Evaluation)|e2.evidence>e.evidence){best=Some((c2,e2));} } }
        if let Some((c2,e2))=best { if e2.evidence>base+10.0 { let (c3,e3)=climb(c2,curves,&ones,&prior,1.0,12).unwrap(); let o=out(&c3,&e3,curves.len(),&prior); outs[0]=(c3,o);} let _=e2; }
    }}
    let _=Rotation3::<f64>::identity();
    outs.into_iter().map(|x|x.1).collect()
}
