#include "ext.hpp"
using F=Fidelity;
// S7 angular momentum of damped circular ringing
TEST(S,7){Scene s;double R=0.1;for(int k=0;k<3;++k)for(int c=0;c<3;++c)point(s,k==1?2.:1.,{k-1.0,R*std::cos(2*M_PI*c/3),R*std::sin(2*M_PI*c/3)});
  for(int k=0;k<3;++k)for(int c=0;c<3;++c)link(s,{3*k+c,3*k+(c+1)%3},Spring{2e4});
  for(int k=0;k<2;++k)for(int c=0;c<3;++c){link(s,{3*k+c,3*k+3+c},Spring{2e4});link(s,{3*k+c,3*k+3+(c+1)%3},Spring{2e4});link(s,{3*k+c,3*k+3+(c+2)%3},Spring{2e4});}
  publish_all(s);auto S_=st(s);double w=S_->omega[1];std::printf("omega %g %g %g max %g\n",S_->omega[0],S_->omega[1],S_->omega[2],S_->omega.maxCoeff());
  s.rate=S_->omega.maxCoeff()/0.5;s.damping.modal_ratio=0.01;for(double q:{1.5e-3}){s.initial.points.clear();add_mode(s,*S_,1,q,0);add_mode(s,*S_,2,0,q*w);
  Load L;L.axes=Axes::kWorld;double f=0.5e-3*w*w;for(int c=0;c<3;++c){L.forces.push_back({c,{0,f,0}});L.forces.push_back({3+c,{0,-2*f,0}});L.forces.push_back({6+c,{0,f,0}});}s.loads={L};
  std::vector<double> t;for(double x:{600.,1000.,1500.})t.push_back(x/w);
  show("S7",s,s,t,{F::kSpinLoaded,F::kSeparated});}}
TEST(S,6){for(double c:{1000.}){Scene s;for(int k=0;k<4;++k)point(s,1.,{1.0*k,0.1*(k%2),0.05*k*k});for(int k=0;k<3;++k)link(s,{k,k+1},Beam{.EA=1e4,.GJ=100,.EI_y=100,.EI_z=120,.y_axis=Vector3d(0,0.2,1)});
  link(s,{0,3},Dashpot{c});publish_all(s);s.rate=200;auto S_=st(s);double w=lowest_of(*S_),P=2*M_PI/w;add_mode(s,*S_,0,1e-5,0);
  show("S6",s,s,{0.5*P,2.3*P},{F::kFull});}}
TEST(S,8){std::mt19937_64 g(7);std::uniform_real_distribution<double>u(-1,1);Scene s;
  for(int k=0;k<6;++k)point(s,10,{2*std::cos(k*M_PI/3),2*std::sin(k*M_PI/3),0.8*((k%2)?1:-1)});int a=point(s,1,{-0.3,0.05,0}),b=point(s,1,{0.3,0,0.05});
  for(int i=0;i<6;++i){link(s,{a,i},Spring{300.+10*i});link(s,{b,i},Spring{320.+8*i});for(int j=i+1;j<6;++j)link(s,{i,j},Spring{200.+11*i+j});}link(s,{a,b},Spring{2e4});
  publish_all(s);s.pushable={a,b};s.rate=1000;s.damping.modal_ratio=0.02;s.force_limit=100;
  Vector3d n=(s.points[b].position-s.points[a].position).normalized();double f=5.;
  Scene truth=s;Load L;L.axes=Axes::kWorld;L.forces={{a,-f*n},{b,f*n}};truth.loads={L};
  ForceCommand c=make_command(0,1,Axes::kWorld);for(auto&p:L.forces)add_force(c,p.point,p.force);
  auto S_=st(s);for(int i=0;i<S_->omega.size();++i)std::printf(" %.3g",S_->omega[i]);std::printf("\n");
  for(double tol:{0.02}){Scene j=s;j.leave_out.tolerance=tol;j.leave_out.on_need=OnNeed::kRefuse;
  Faults ff;auto SS=build_structure(j,ff);auto pl=make_plan(j,*SS,ff);std::printf("tol %g modes %d of %d\n",tol,(int)pl->num_elastic,(int)SS->omega.size());for(auto&p:pl->parts)std::printf("  part share_per_force %g\n",p.share_per_force);
  show("S8",truth,j,{0.05,1.,10.},{F::kSeparated},{{0.0,c}});}}
TALLY
