#pragma once
#include "drv.hpp"
#include <Eigen/Eigenvalues>
struct Cmd{double t;ForceCommand c;};
// judged with commands; verbose rows
inline Res judge_c(const Scene& judged,Fidelity rung,const TruthRun& tr,int mult,std::vector<Cmd> cmds={},bool verbose=true){
  Res R;Scene sc=judged;sc.fidelity=rung;sc.rate*=mult;
  Faults faults;auto S_=build_structure(sc,faults);auto plan=make_plan(sc,*S_,faults);
  for(auto&f:faults)if(verbose)std::printf("   [%s] %s\n",f.severity==Fault::Severity::kError?"error":"warn",f.message.c_str());
  if(!plan||has_error(faults)){std::printf("NO PLAN\n");return R;}
  Simulation sim(*plan);Budget none;Judgement j(sim.plan);j.take(sim.state,none);
  Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(judged,m,r);double maxshare=0;
  for(size_t k=0;k<tr.V.size();++k){auto tick=std::llround(tr.t[k]*sc.rate);
    while(sim.state.tick<tick){std::vector<ForceCommand> now;for(auto&c:cmds)if(std::llround(c.t*sc.rate)==sim.state.tick){now.push_back(c.c);if(now.back().duration_ticks<(std::int64_t{1}<<39))now.back().duration_ticks*=mult;}
      sim.run(1,now);j.take(sim.state,none);}
    Eigen::Matrix3Xd V=elastic_displacements(m,r,sim.positions_W());
    auto v=j.now();double scale=std::max(v.scale,mean_size(tr.V[k],m));double share=mean_size(V-tr.V[k],m)/scale;
    maxshare=std::max(maxshare,share);R.max_share=maxshare;++R.n;
    bool g=v.word==Verdict::Word::kGood;R.good+=g;
    if(g&&share>R.worst_good){R.worst_good=share;R.t_worst=tr.t[k];R.est=v.error/v.scale;}
    if(g&&share>0.05){++R.fg;if(R.first_fg<0)R.first_fg=tr.t[k];}
    bool silly=v.word==Verdict::Word::kOutside&&maxshare<0.01;
    if(silly&&!R.silly){R.silly=true;R.silly_text=describe(sim.plan,v)+" at "+std::to_string(tr.t[k]);}
    if(verbose)std::printf("   t %9.4g |V| %.3e truth %.3e scale %.3e err %.3e est %.3e %s%s%s\n",tr.t[k],mean_size(V,m),mean_size(tr.V[k],m),scale,share,v.error/scale,name_of(v.word),g&&share>0.05?" <<FALSE":"",silly?(" <<SILLY "+R.silly_text).c_str():"");
  }
  std::fflush(stdout);
  return R;}
inline void show(const std::string& name,const Scene& truth,const Scene& judged,std::vector<double> t,std::vector<Fidelity> rungs,std::vector<Cmd> cmds={},double tol=1e-9){
  for(auto&x:t)x=std::round(x*judged.rate)/judged.rate;
  ++tally.scenes;auto tr=truth_run(truth,t,tol);if(!tr.error.empty())std::printf("%s: truth %s (%zu)\n",name.c_str(),tr.error.c_str(),tr.V.size());
  for(auto r:rungs){std::printf("== %s %s\n",name.c_str(),name_of(r));auto R=judge_c(judged,r,tr,1,cmds);
    tally.words+=R.n;tally.good+=R.good;tally.false_good+=R.fg;tally.silly+=R.silly;++tally.runs;
    if((R.fg||R.silly)&&getenv("VERIFY")){auto fine=truth_run(truth,t,tol/100);Eigen::VectorXd m;Eigen::Matrix3Xd rr;masses(truth,m,rr);double d=0,s=0;
      for(size_t k=0;k<std::min(fine.V.size(),tr.V.size());++k){d=std::max(d,mean_size(fine.V[k]-tr.V[k],m));s=std::max(s,mean_size(fine.V[k],m));}
      std::printf("  VERIFY tol/100: truth differs %.1e; rate x4:\n",d/s);judge_c(judged,r,fine,4,cmds);}}
  std::fflush(stdout);}
inline Scene cross7(double zeta){Scene scene;
  for (const double x : {-1.0, 0.0, 1.0}) point(scene, 1.0, {x, 0.0, 0.0});
  for (const double side : {1.0, -1.0}) point(scene, 0.6, {0.0, 0.8 * side, 0.05 * side});
  for (const double side : {1.0, -1.0}) point(scene, 0.02, {0.02, 0.02, 0.4 * side});
  for (int a = 0; a < 7; ++a) for (int b = a + 1; b < 7; ++b) link(scene, {a, b}, Spring{1000.0 + 37.0 * a + 91.0 * b});
  scene.damping.modal_ratio = zeta;publish_all(scene);for(int i=0;i<7;++i)scene.pushable.push_back(i);
  auto S_=st(scene);scene.rate=std::ceil(S_->omega.maxCoeff());return scene;}
inline Vector3d axis_of(const Structure& s,int k){Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> a(s.mass_properties.inertia);return a.eigenvectors().col(k);}
#define TALLY TEST(Z,tally){std::printf("TALLY scenes %d runs %d words %d good %d false %d silly runs %d\n",tally.scenes,tally.runs,tally.words,tally.good,tally.false_good,tally.silly);}
