#include <chrono>
#pragma once
#include <functional>
#include <map>
#include "tests/motion/word_truth.hpp"
using namespace freeflex; using namespace freeflex::testing;
using Eigen::Vector3d;
struct Tally { int scenes=0, words=0, good=0, false_good=0, silly=0, runs=0, runs_fg=0; };
inline Tally tally;
inline double lowest_of(const Structure& s){double l=0;for(double o:s.omega) if(o>0&&(l==0||o<l)) l=o;return l;}
inline std::shared_ptr<Structure> st(const Scene& s){Faults f;auto x=build_structure(s,f);if(!x||has_error(f)){for(auto&q:f)std::printf("FAULT %s\n",q.message.c_str());return nullptr;}return std::make_shared<Structure>(std::move(*x));}
inline void add_mode(Scene& sc,const Structure& s,int mode,double q,double qd){
  if(sc.initial.points.empty()) for(int i=0;i<(int)sc.points.size();++i) sc.initial.points.push_back({i,Vector3d::Zero(),Vector3d::Zero()});
  for(auto& p:sc.initial.points){p.displacement+=q*s.shapes.block<3,1>(3*p.point,mode);p.velocity+=qd*s.shapes.block<3,1>(3*p.point,mode);}
}
inline void publish_all(Scene& s){s.publication.points.clear();for(int i=0;i<(int)s.points.size();++i)s.publication.points.push_back(i);}
struct Res {double worst_good=0,t_worst=0,est=0; int good=0,n=0,fg=0; double first_fg=-1, max_share=0; bool silly=false; std::string silly_text;};
inline double mean_size(const Eigen::Matrix3Xd& f,const Eigen::VectorXd& m){return std::sqrt((f.colwise().squaredNorm()*m)(0)/m.sum());}
struct TruthRun { std::vector<double> t; std::vector<Eigen::Matrix3Xd> V; std::string error; double acc=0; };
inline void masses(const Scene& s,Eigen::VectorXd& m,Eigen::Matrix3Xd& r){auto n=(Eigen::Index)s.points.size();m.resize(n);r.resize(3,n);for(Eigen::Index i=0;i<n;++i){m[i]=s.points[i].mass;r.col(i)=s.points[i].position;}}
inline TruthRun truth_run(const Scene& s,std::vector<double> t,double tol=1e-9){
  TruthRun o;o.t=t;std::string e;auto sys=make_true_geometry(s,e);if(!sys){o.error=e;return o;}
  ReferenceOptions op;op.tolerance=tol;
  auto start=std::chrono::steady_clock::now();
  op.is_stopped=[start]{return std::chrono::steady_clock::now()-start>std::chrono::seconds(getenv("TMAX")?atoi(getenv("TMAX")):40);};
  auto run=integrate(*sys,t,op);o.error=run.error;
  Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(s,m,r);
  for(auto& x:run.states)o.V.push_back(elastic_displacements(m,r,x.p_W));
  return o;}
inline std::vector<double> checks(const Scene& s,double end,int n){std::vector<double> t;std::mt19937 g(5);std::uniform_real_distribution<double> u(0,1);
  long last=0;for(int k=1;k<=n;++k){long tick=std::lround((k-0.9*u(g))/n*end*s.rate);if(tick<=last)tick=last+1;last=tick;t.push_back(tick/s.rate);}return t;}
// judged: scene for the rung; returns summary
inline Res judge(const Scene& judged,Fidelity rung,const TruthRun& tr,int mult,bool verbose=false){
  Res R;Scene sc=judged;sc.fidelity=rung;sc.rate*=mult;
  Simulation sim(sc);Budget none;Judgement j(sim.plan);j.take(sim.state,none);
  Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(judged,m,r);double maxshare=0;
  for(size_t k=0;k<tr.V.size();++k){auto tick=std::llround(tr.t[k]*sc.rate);
    while(sim.state.tick<tick){sim.run(1);j.take(sim.state,none);}
    Eigen::Matrix3Xd V=elastic_displacements(m,r,sim.positions_W());
    auto v=j.now();double scale=std::max(v.scale,mean_size(tr.V[k],m));double share=mean_size(V-tr.V[k],m)/scale;
    maxshare=std::max(maxshare,share);R.max_share=maxshare;++R.n;
    bool g=v.word==Verdict::Word::kGood;R.good+=g;
    if(g&&share>R.worst_good){R.worst_good=share;R.t_worst=tr.t[k];R.est=v.error/v.scale;}
    if(g&&share>0.05){++R.fg;if(R.first_fg<0)R.first_fg=tr.t[k];}
    if(v.word==Verdict::Word::kOutside&&maxshare<0.01&&!R.silly){R.silly=true;R.silly_text=describe(sim.plan,v);R.silly_text+=" at "+std::to_string(tr.t[k]);}
    if(verbose)std::printf("   t %9.4g |V| %.3e truth %.3e scale %.3e err %.3e est %.3e %s\n",tr.t[k],mean_size(V,m),mean_size(tr.V[k],m),scale,share,v.error/v.scale,name_of(v.word));
  }
  return R;}
inline bool study(const std::string& name,const Scene& truth,double end,std::vector<Fidelity> rungs={Fidelity::kSeparated,Fidelity::kSpinLoaded,Fidelity::kCoupled},int n=30,const Scene* judged=nullptr){
  ++tally.scenes;bool any=false;
  auto t=checks(truth,end,n);auto tr=truth_run(truth,t);
  if(!tr.error.empty()&&tr.V.empty()){std::printf("%s: truth %s\n",name.c_str(),tr.error.c_str());return false;}
  if(!tr.error.empty())std::printf("%s: truth ended early at %zu of %d: %s\n",name.c_str(),tr.V.size(),n,tr.error.c_str());
  for(auto rung:rungs){auto R=judge(judged?*judged:truth,rung,tr,1);
    tally.words+=R.n;tally.good+=R.good;tally.false_good+=R.fg;tally.silly+=R.silly;tally.runs++;tally.runs_fg+=R.fg>0;
    std::printf("%s %-11s n%d good %d FALSE %d worst good %.2e (est %.2e) at t %.4g, first false t %.4g; max err %.2e%s%s\n",name.c_str(),name_of(rung),R.n,R.good,R.fg,R.worst_good,R.est,R.t_worst,R.first_fg,R.max_share,R.silly?" SILLY ":"",R.silly_text.c_str());
    if(R.fg||R.silly){any=true;
      if(getenv("VERIFY")){
      TruthRun fine=truth_run(truth,t,1e-11);Eigen::VectorXd m;Eigen::Matrix3Xd r;masses(truth,m,r);double d=0,s=0;
      for(size_t k=0;k<std::min(fine.V.size(),tr.V.size());++k){d=std::max(d,mean_size(fine.V[k]-tr.V[k],m));s=std::max(s,mean_size(fine.V[k],m));}
      auto R2=judge(judged?*judged:truth,rung,tr,4);
      std::printf("   VERIFY truth tol 1e-9 vs 1e-11: %.1e of max; rate x4: good %d FALSE %d worst good %.2e est %.2e %s\n",d/s,R2.good,R2.fg,R2.worst_good,R2.est,R2.silly_text.c_str());}
      if(getenv("VERBOSE"))judge(judged?*judged:truth,rung,tr,1,true);
    }
    std::fflush(stdout);}
  return any;}
inline void link(Scene& s,std::vector<int> p,LinkKind k){Link l;l.name="l"+std::to_string(s.links.size());l.points=p;l.kind=k;s.links.push_back(l);}
inline int point(Scene& s,double m,Vector3d at){s.points.push_back({"p"+std::to_string(s.points.size()),m,at,{}});return (int)s.points.size()-1;}
