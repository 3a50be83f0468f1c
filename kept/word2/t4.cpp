#include "ext.hpp"
using F=Fidelity;
std::vector<PointLoad> tri(double f){return {{0,{0.5*f,f,0.2*f}},{1,{-f,-2*f,-0.4*f}},{2,{0.5*f,f,0.2*f}}};}
TEST(V,1){Scene s=cross7(0.1);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Scene truth=s;Load L;L.axes=Axes::kWorld;L.forces=tri(f);truth.loads={L};
  ForceCommand c=make_command(0,1,Axes::kWorld);for(auto&p:L.forces)add_force(c,p.point,p.force);
  show("S1 cmd",truth,s,{2./spin,3./spin},{F::kSpinLoaded,F::kCoupled},{{0.0,c}});}
TEST(V,2){Scene s=cross7(0.005);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w,P=2*M_PI/w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Load L;L.axes=Axes::kWorld;L.forces=tri(f);double T1=std::round(1.5/spin*s.rate)/s.rate,t0=std::round(4.5/spin*s.rate)/s.rate,D=std::round(0.5*P*s.rate)/s.rate;L.history=PulseHistory{0,T1};s.loads={L};
  Load M=L;M.history=PulseHistory{t0,D};s.loads.push_back(M);
  show("S2",s,s,{t0+0.7*P,t0+1.2*P,t0+3.4*P,t0+8.1*P},{F::kSpinLoaded,F::kCoupled});}
TEST(V,3){Scene s=cross7(0.01);auto S_=st(s);double w=lowest_of(*S_),spin=0.01*w,f=2e-3*w*w;s.initial.angular_velocity=spin*axis_of(*S_,1);
  Load L;L.axes=Axes::kWorld;L.forces=tri(f);L.history=PulseHistory{0,std::round(1.5/spin*s.rate)/s.rate};s.loads={L};
  Load M=L;M.forces=tri(0.1*f);M.history=SineHistory{w/(2*M_PI),0};s.loads.push_back(M);
  show("S3",s,s,{3.3/spin,4./spin,5./spin},{F::kSpinLoaded,F::kCoupled});}
TEST(V,4){Scene s;for(int k=0;k<3;++k)point(s,1+0.2*k,{1.0*k,0,0});
  for(int k=0;k<2;++k){link(s,{k,k+1},Spring{3e3});link(s,{k,k+1},Dashpot{100});}
  link(s,{0,1,2},BendingSpring{100.});publish_all(s);s.rate=500;auto S_=st(s);double w=lowest_of(*S_),P=2*M_PI/w;
  add_mode(s,*S_,0,1e-3,0);Load L;L.axes=Axes::kBody;double Fx=6;L.forces={{0,{-Fx,0,0}},{2,{Fx,0,0}}};L.history=SineHistory{2*w/(2*M_PI),0};s.loads={L};
  std::vector<double> t;for(double x:{0.5,1.2,2.3,4.4,6.3,9.2,14.1,20.})t.push_back(x*P);
  show("S4 pulsating, c 100",s,s,t,{F::kSeparated,F::kExactBars});
  // modest static load, dashpot of time constant 1 s
  s.links[1].kind=Dashpot{3000};s.links[3].kind=Dashpot{3000};s.loads[0].history=ConstantHistory{};
  show("S4 c 3000 static",s,s,t,{F::kSeparated,F::kExactBars});
  // viscous links: springs with a rate part
  Scene v=s;v.links={s.links[0],s.links[2],s.links[4]};v.links[0].viscous=v.links[1].viscous=1.0;
  show("S4 viscous 1 s",v,v,t,{F::kSeparated,F::kExactBars});
  // Rayleigh's beta, modal ratio
  Scene b=v;b.links[0].viscous=b.links[1].viscous=0;b.damping.modal_ratio=0;b.damping.mode_ratios={{3,20.},{4,20.}};
  auto SB=st(b);for(int i=0;i<SB->omega.size();++i)std::printf(" %g",SB->omega[i]);std::printf("\n");
  show("S4 axial modes ratio 20",b,b,t,{F::kSeparated});}
TALLY
