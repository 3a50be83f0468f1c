#include "ext.hpp"
using F=Fidelity;
struct G{std::mt19937_64 e;double u(double a,double b){return std::uniform_real_distribution<double>(a,b)(e);}double dec(double a,double b){return std::exp(u(std::log(a),std::log(b)));}int n(int a,int b){return std::uniform_int_distribution<int>(a,b)(e);}Vector3d d(){std::normal_distribution<double> x;return Vector3d(x(e),x(e),x(e)).normalized();}};
TEST(Fz,all){int from=atoi(getenv("FROM")),to=atoi(getenv("TO"));auto start=std::chrono::steady_clock::now();
 for(int seed=from;seed<to;++seed){if(std::chrono::steady_clock::now()-start>std::chrono::seconds(150))break;G g{std::mt19937_64(seed*7919+13)};Scene s;int N=g.n(5,7);
  while((int)s.points.size()<N){Vector3d p(g.u(-1.5,1.5),g.u(-.8,.8),g.u(-.6,.6));bool ok=true;for(auto&q:s.points)ok=ok&&(q.position-p).norm()>0.6;if(ok)point(s,g.dec(.5,2),p);}
  for(int a=0;a<N;++a)for(int b=a+1;b<N;++b)link(s,{a,b},Spring{g.dec(1e3,1e4)});
  auto S0=st(s);double w=lowest_of(*S0),M=S0->mass_properties.mass;std::string d;
  int nd=g.n(0,2);for(int k=0;k<nd;++k){int a=g.n(0,N-1),b=(a+g.n(1,N-1))%N;double c=g.dec(1,1e3);link(s,{a,b},Dashpot{c});d+=" dash"+std::to_string((int)c);}
  int dm=g.n(0,3);if(dm==1)s.damping.modal_ratio=g.dec(.002,.1);if(dm==2){s.damping.modal_ratio=g.dec(1,20);d+=" over";}if(dm==3)s.damping.beta=g.dec(1e-4,.3);
  s.groups.push_back({"g1",{0,1,2,3},{}});publish_all(s);for(int i=0;i<N;++i)s.pushable.push_back(i);
  double spin=g.n(0,1)?0:g.dec(3e-4,3e-2)*w;s.initial.angular_velocity=spin*g.d();
  auto S_=st(s);s.rate=std::max(S_->omega.maxCoeff()/0.4,20*w/6.28);double P=2*M_PI/w,end=g.dec(4,120)*P;
  if(g.n(0,2)==0){double q=g.dec(1e-5,1e-3);add_mode(s,*S_,0,q*g.u(-1,1),0);add_mode(s,*S_,1,q*g.u(-1,1),q*w*g.u(-1,1));d+=" ring";}
  int nl=g.n(1,3);Scene truth=s;std::vector<Cmd> cmds;
  for(int k=0;k<nl;++k){Load L;int ax=g.n(0,4);L.axes=ax<=1?Axes::kWorld:ax<=3?Axes::kBody:Axes::kLocal;double f=M*w*w*g.dec(1e-5,2e-3);int kind=g.n(0,3);
   if(kind==0)L.forces={{g.n(0,N-1),f*g.d()}};
   if(kind==1||kind==2){int a=g.n(0,N-1),b=(a+g.n(1,N-1))%N;Vector3d x=kind==1?(s.points[b].position-s.points[a].position).normalized():g.d();L.forces={{a,f*x},{b,-f*x}};}
   if(kind==3&&ax<4)L.wrenches={{0,f*g.d(),0.3*f*g.d()}};if(kind==3&&ax==4)L.forces={{0,f*g.d()}};
   int h=g.n(0,4);auto T=[&](double x){return std::round(x*s.rate)/s.rate;};
   if(h==1)L.history=PulseHistory{T(g.u(0,.5)*end),std::max(T(g.dec(.02,.5)*end),2/s.rate)};
   if(h==2)L.history=SineHistory{g.dec(.05,1.2)*w/(2*M_PI),g.u(0,6)};
   if(h==3)L.history=TableHistory{{0,T(.1*end)+1/s.rate,T(.4*end)+2/s.rate,T(.7*end)+3/s.rate},{0,g.u(-1,1),g.u(-1,1),g.u(0,1)}};
   d+=std::string(" L")+"wbl"[(int)L.axes]+std::to_string(kind)+"h"+std::to_string(h);
   truth.loads.push_back(L);
   if(h==1&&ax<4){auto&p=std::get<PulseHistory>(L.history);ForceCommand c=make_command(k,1,L.axes,std::max<long>(1,std::llround((p.start+p.duration)*s.rate)-std::llround(p.start*s.rate)));for(auto&q:L.forces)add_force(c,q.point,q.force);for(auto&q:L.wrenches){Wrench wr{};wr.group=q.group;for(int i=0;i<3;++i){wr.force[i]=q.force[i];wr.torque[i]=q.torque[i];}c.wrenches[c.num_wrenches++]=wr;}cmds.push_back({p.start,c});d+="c";}
   else s.loads.push_back(L);}
  if(g.n(0,2)==0){s.leave_out.on_need=OnNeed::kReplan;d+=" replan";}
  if(g.n(0,3)==0&&cmds.size()==0){s.leave_out.tolerance=1e-3;s.leave_out.horizon=end;d+=" lo";}
  std::vector<double> t;for(int k=1;k<=10;++k)t.push_back(std::max(1.,std::round((k-g.u(0,.8))/10*end*s.rate))/s.rate);std::sort(t.begin(),t.end());t.erase(std::unique(t.begin(),t.end()),t.end());
  ++tally.scenes;auto tr=truth_run(truth,t,1e-9);if(!tr.error.empty()){std::printf("%d truth %s %zu%s\n",seed,tr.error.c_str(),tr.V.size(),d.c_str());}
  for(auto r:{F::kSeparated,F::kSpinLoaded,F::kCoupled,F::kExactBars}){Scene j=s;if(r==F::kCoupled||r==F::kExactBars){double mx=0;/*rate*/}
   j.fidelity=r;Faults ff;auto SJ=st(j);auto pl=make_plan(j,*SJ,ff);if(!pl||has_error(ff)){if(r<F::kCoupled){std::printf("%d no plan:",seed);for(auto&x:ff)if(x.severity==Fault::Severity::kError)std::printf(" %s",x.message.c_str());std::printf("\n");}continue;}
   auto R=judge_c(j,r,tr,1,cmds,false);tally.words+=R.n;tally.good+=R.good;tally.false_good+=R.fg;tally.silly+=R.silly;++tally.runs;
   if(R.fg||R.silly)std::printf("%d %s spin %.1e end %.0f P:%s\n  good %d/%d FALSE %d worst %.2e (est %.1e) at %.3g P, max %.2e %s %s\n",seed,name_of(r),spin/w,end/P,d.c_str(),R.good,R.n,R.fg,R.worst_good,R.est,R.t_worst/P,R.max_share,R.silly?"SILLY":"",R.silly_text.c_str());
   if((R.fg||R.silly)&&getenv("VERB")&&atoi(getenv("VERB"))==(int)r){judge_c(j,r,tr,1,cmds,true);if(getenv("VERIFY")){auto fine=truth_run(truth,t,1e-11);judge_c(j,r,fine,4,cmds,true);}}
   std::fflush(stdout);}}}
TALLY
